// Quaternions after a turn about an axis of their own, for tests: node turned_about.mjs MODULE GIVEN.
import { pathToFileURL } from "node:url";

const { turnedAbout } = await import(pathToFileURL(process.argv[2]).href);
const given = JSON.parse(process.argv[3]);
process.stdout.write(JSON.stringify(given.map(({ q, axis, angle }) => turnedAbout(q, axis, angle))));
