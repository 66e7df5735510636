"""Times of the generated C beside its alternatives, each pair in one run: F by hand, and Ipopt through CasADi.

Run by hand: ``.venv/bin/python bench/embedding.py``. The aims: F within 1.3 times the function written by hand, and a
solve of the paper's Section 4.1 at least 30 times faster than Ipopt's.
"""

import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import casadi as ca
import numpy as np

from screwsynth.nlp import Nlp, formulate, load_case
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.program.sampling import starting_points

NAME, STARTS = "paper-4.1-helical", 300
DRIVER = """#include "ID.h"
#include <stdio.h>
#include <time.h>
int main(void) {
    static double work[BIG_SOLVERWORK], x[BIG_N + 1];
    static int iwork[BIG_SOLVERIWORK];
    ID_problem problem;
    ID_result result;
    ID_defaults(&problem);
    problem.x0 = x;
    problem.seeds = 0;
    for (;;) {
        struct timespec begin, end;
        int i, status = 0;
        for (i = 0; i < BIG_N; ++i)
            if (scanf("%lf", &x[i]) != 1) return 0;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        status = ID_solve(&problem, &result, work, iwork);
        clock_gettime(CLOCK_MONOTONIC, &end);
        printf("%d %.17g ", status, result.F);
        printf("%.9g\\n", (end.tv_sec - begin.tv_sec) + 1e-9 * (end.tv_nsec - begin.tv_nsec));
        fflush(stdout);
    }
}
"""


def ipopt(nlp: Nlp) -> ca.Function:
    """Return Ipopt over scaled variables, as a user of CasADi would call it."""
    s, program = ca.SX.sym("s", nlp.n), nlp.program
    F, g = program.values.call([nlp.centre + nlp.scale * s, ca.DM(nlp.arguments)])
    problem = {"x": s, "f": nlp.sign / nlp.objective_scale * F, "g": g}
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "bound_relax_factor": 0.0}}
    return ca.nlpsol("solver", "ipopt", problem, options)


nlp = formulate(load_case(NAME))
prefix = "screwsynth_" + NAME.replace("-", "_").replace(".", "_")
points = starting_points(nlp, STARTS + 1, 2)[1:]
solver = ipopt(nlp)
with tempfile.TemporaryDirectory() as folder:
    for file, text in generate_c(load_case(NAME), "").items():
        (Path(folder) / file).write_text(text)
    (Path(folder) / "driver.c").write_text(DRIVER.replace("ID", prefix).replace("BIG", prefix.upper()))
    (Path(folder) / "handwritten.c").write_text((Path(__file__).parent / "handwritten.c").read_text())
    parts = [path.name for path in Path(folder).glob(f"{prefix}*.c")]
    for program in ("driver", "handwritten"):
        flags = ["-O2", "-std=gnu99", f"{program}.c", *parts, "-lm", "-o", program]
        subprocess.run([os.environ.get("CC", "cc"), *flags], cwd=folder, check=True)
    subprocess.run(["./handwritten"], cwd=folder, check=True)
    with subprocess.Popen(["./driver"], cwd=folder, stdin=-1, stdout=-1, text=True, bufsize=1) as driver:
        rows = []
        for point in points:  # in turns, so that a busy machine burdens both
            driver.stdin.write(" ".join(map(repr, map(float, point))) + "\n")
            driver.stdin.flush()
            status, F, seconds = map(float, driver.stdout.readline().split())
            began = time.perf_counter()
            found = solver(x0=(point - nlp.centre) / nlp.scale, lbx=-1, ubx=1, lbg=nlp.g_lower, ubg=nlp.g_upper)
            rows.append((status, F, seconds, time.perf_counter() - began, float(found["f"])))
        driver.stdin.close()
status, F, own, theirs, f = np.array(rows).T
print(f"{STARTS} starts: {(status == 0).sum():.0f} OK, F {F.min():.7g} to {F.max():.7g}")
print(f"a solve: {1e6 * statistics.median(own):.1f} us in C, {1e6 * statistics.median(theirs):.0f} us by Ipopt")
print(f"median of the ratios: {statistics.median(theirs / own):.0f} times")
