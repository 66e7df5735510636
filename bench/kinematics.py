"""Kinematics in C: nanoseconds of a call beside hand-written closed forms in one run, code size and stack.

Usage: python bench/kinematics.py [NAME ...]. The hand-written forms are six leg lengths of a hexapod, and the three
cranks of a rotary Delta. Sizes are those of the functions that a program links for one call, without the mathematics
library.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from screwsynth.nlp.case.robotcase import read_robot_case
from screwsynth.nlp.embedding.kinematicsfiles import generate_kinematics, kinematics_prefix
from screwsynth.nlp.embedding.measure import CORTEX_M7, X86_64, Target, stack_bound

_FLAGS = ["-std=c99", "-O2", "-ffunction-sections", "-fdata-sections"]
_FUNCTIONS = ("motors", "motor", "rates", "torques", "forward")
_RUNS = 2_000_000

#: Hand-written inverse kinematics: legs with the joints of the case; cranks of a Delta by its dimensions.
_HEXAPOD = """
static void by_hand(const double *p, const double *R, double *q) {
    static const double b[6][3] = {%(base)s}, a[6][3] = {%(platform)s};
    int i;
    for (i = 0; i < 6; ++i) {
        double x = p[0] + R[0] * a[i][0] + R[1] * a[i][1] + R[2] * a[i][2] - b[i][0];
        double y = p[1] + R[3] * a[i][0] + R[4] * a[i][1] + R[5] * a[i][2] - b[i][1];
        double z = p[2] + R[6] * a[i][0] + R[7] * a[i][1] + R[8] * a[i][2] - b[i][2];
        q[i] = sqrt(x * x + y * y + z * z);
    }
}
"""
_DELTA = """
static void by_hand(const double *p, const double *R, double *q) {
    static const double c[3] = {1.0, -0.5, -0.5}, s[3] = {0.0, 0.86602540378443865, -0.86602540378443865};
    static const double rb = %(rb)r, rp = %(rp)r, arm = %(arm)r, rod = %(rod)r, tilt = %(tilt)r;
    int i;
    (void)R;
    for (i = 0; i < 3; ++i) {
        double x = c[i] * p[0] + s[i] * p[1] + rp - rb, y = -s[i] * p[0] + c[i] * p[1], z = -p[2];
        double e = (x * x + y * y + z * z + arm * arm - rod * rod) / (2.0 * arm), n = x * x + z * z;
        /* x cos(t) + z sin(t) = e, knee outside */
        double root = sqrt(n - e * e);
        q[i] = atan2(z * e - x * root, x * e + z * root) - tilt;
    }
}
"""
_MAIN = """
#include "%(file)s.h"
#include <math.h>
#include <stdio.h>
#include <time.h>
%(hand)s
int main(void) {
    double p[3], R[9], q[%(KIN)s_ACTUATORS], own[%(KIN)s_ACTUATORS], z, sum = 0.0, off = 0.0, one, other;
    int r, i;
    clock_t begin;
    %(kin)s_home(p, R);
    z = p[2];
    for (r = 0; r < 100; ++r) {
        p[0] = %(size)r * 1e-3 * (r %% 10);
        p[1] = %(size)r * 1e-3 * (r / 10);
        if (%(kin)s_motors(p, R, q)) return 1;
        by_hand(p, R, own);
        for (i = 0; i < %(KIN)s_ACTUATORS; ++i)
            if (!(fabs(q[i] - own[i]) <= off)) off = fabs(q[i] - own[i]);
    }
    begin = clock();
    for (r = 0; r < RUNS; ++r) {
        p[2] = z + %(size)r * 1e-6 * (r & 63);
        if (%(kin)s_motors(p, R, q) == 0) sum += q[0];
    }
    one = (double)(clock() - begin) / CLOCKS_PER_SEC / RUNS * 1e9;
    begin = clock();
    for (r = 0; r < RUNS; ++r) {
        p[2] = z + %(size)r * 1e-6 * (r & 63);
        by_hand(p, R, q);
        sum += q[0];
    }
    other = (double)(clock() - begin) / CLOCKS_PER_SEC / RUNS * 1e9;
    printf("motors %%.1f ns, by hand %%.1f ns, %%.2f times; largest difference %%.1e\\n", one, other, one / other, off);
    return sum == sum ? 0 : 1;
}
"""


def _written(name: str, folder: Path) -> tuple[str, str, float]:
    """Write the kinematics of a case; return file, prefix and a length of the robot."""
    case = read_robot_case(name).case
    files = generate_kinematics(case, "")
    for each, text in files.items():
        (folder / each).write_text(text, encoding="utf-8")
    file = next(each for each in files if each.endswith("-kinematics.h")).removesuffix(".h")
    size = float(re.search(r"#define SIZE (\S+)", files[f"{file}.c"]).group(1))  # type: ignore[union-attr]
    return file, kinematics_prefix(case.name), size


def by_hand(name: str) -> str:
    """Return the times of motors and of the hand-written form for a robot."""
    case = read_robot_case(name).case
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root)
        file, kin, size = _written(name, folder)
        values = {item.name: case.components(item.name) for item in case.model.parameters}
        if name == "delta":
            hand = _DELTA % {key: each[0] for key, each in values.items()}
        else:
            rows = {
                end: ", ".join(f"{{{', '.join(map(repr, values[f'{end}_{k}']))}}}" for k in range(1, 7))
                for end in ("base", "platform")
            }
            hand = _HEXAPOD % rows
        text = _MAIN % {"file": file, "kin": kin, "KIN": kin.upper(), "hand": hand, "size": size}
        (folder / "main.c").write_text(text, encoding="utf-8")
        sources = ["main.c", *(each.name for each in folder.glob("*-kinematics*.c"))]
        subprocess.run(["gcc", *_FLAGS, f"-DRUNS={_RUNS}", *sources, "-lm", "-o", "main"], cwd=folder, check=True)
        return subprocess.run(["./main"], cwd=folder, check=True, capture_output=True, text=True).stdout.strip()


def sizes(name: str, target: Target) -> list[str]:
    """Return code size and stack of each function of a robot on a target."""
    compiler = next((each for each in target.compilers if shutil.which(each)), None)
    if compiler is None:
        return ["no compiler"]
    found = []
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root)
        _, kin, _ = _written(name, folder)
        sources = [each.name for each in folder.glob("*-kinematics*.c")]
        subprocess.run(
            [compiler, *target.flags, *_FLAGS, "-fcallgraph-info=su", "-c", *sources], cwd=folder, check=True
        )
        graphs = {each.stem: each.read_text() for each in folder.glob("*.ci")}
        nm = target.size.replace("size", "nm")
        own = {
            line.split()[-1]
            for source in sources
            for line in subprocess.run(
                [nm, source.replace(".c", ".o")], cwd=folder, check=True, capture_output=True, text=True
            ).stdout.splitlines()
            if " U " not in line
        }
        for function in _FUNCTIONS:
            symbol = f"{kin}_{function}"
            if symbol not in own:
                continue
            (folder / "entry.c").write_text(
                f"extern void {symbol}(void); void *volatile kept; int main(void);\n"
                f"int main(void) {{ kept = (void *){symbol}; return 0; }}\n"
            )
            libraries = ["--specs=nosys.specs"] if "arm" in compiler else []
            objects = [source.replace(".c", ".o") for source in sources]
            subprocess.run(
                [compiler, *target.flags, *libraries, "-Wl,--gc-sections", "entry.c", *objects, "-lm", "-o", "linked"],
                cwd=folder, check=True, capture_output=True,
            )  # fmt: skip
            rows = subprocess.run([nm, "-S", "linked"], cwd=folder, check=True, capture_output=True, text=True).stdout
            parts = [row.split() for row in rows.splitlines()]
            flash = sum(int(row[1], 16) for row in parts if len(row) == 4 and row[3] in own)
            found.append(f"{function} {flash} B, stack {stack_bound(graphs, kin, symbol)} B")
    return found


def main() -> None:
    """Print the figures."""
    for name in ("hexapod", "delta"):
        print(f"{name}: {by_hand(name)}")
    for name in sys.argv[1:] or ("hexapod", "delta", "6-rss", "3-rrs", "orthoglide"):
        for target in (X86_64, CORTEX_M7):
            print(f"{name}, {target.name}: {'; '.join(sizes(name, target))}")


if __name__ == "__main__":
    main()
