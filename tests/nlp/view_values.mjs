// Values of a live module at points, for tests: node view_values.mjs FOLDER, with module.mjs, view.wasm and given.json.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const folder = process.argv[2];
const { CaseModule } = await import(pathToFileURL(`${folder}/module.mjs`).href);
const given = JSON.parse(readFileSync(`${folder}/given.json`, "utf8"));
const module = await CaseModule.load(readFileSync(`${folder}/view.wasm`), given.arrays);
const plain = (values) => [...values].map((each) => (Number.isFinite(each) ? each : null));
const found = { points: [], solved: null };
for (const { x, p, pose } of given.points) {
  module.arrays.x.set(x);
  module.arrays.p.set(p);
  const { fault, F } = module.evaluate(pose, true);
  const names = ["gradient", "slopes", "g", "readings", "view", "singular_values"];
  const arrays = Object.fromEntries(names.map((name) => [name, plain(module.arrays[name])]));
  found.points.push({ fault, F: Number.isFinite(F) ? F : null, rank: module.rank(), ...arrays });
}
if (given.seeds !== null) {
  module.exports.reset();
  const answer = module.solve(given.from_x, given.seeds);
  found.solved = { ...answer, x: plain(module.arrays.solution), limits: plain(module.arrays.limit_multipliers) };
}
process.stdout.write(JSON.stringify(found));
