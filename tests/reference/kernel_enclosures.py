"""Enclosures as the C kernel computes them, before it writes them as forms: its headers, compiled once more.

Those of first order. Where a form has one remainder, its terms of second order, which shrink along a ray, its rounding
errors and its interval are apart here, as in the reference.
"""

import ctypes
import shutil
import subprocess
import sysconfig
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy_engine.first_order import Enclosures

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure.tape import Tape

FOLDER = Path(__file__).parents[2] / "nlp" / "proof" / "enclosure"
COMPILER = shutil.which("gcc") or shutil.which("cc")
#: Optimised less than the kernel, which is built for itself; operations in double precision are the same.
FLAGS = ["-shared", "-fPIC", "-O1", "-ffp-contract=off", f"-I{FOLDER}", f"-I{sysconfig.get_path('include')}"]
SOURCE = """
#define Py_LIMITED_API 0x030B0000
#include "kernel/runs.h"

void enclose(int n, const int *code, const double *k, const int *sizes, const double *lower, const double *upper,
             int B, double *const *to, double *a)
{
    Tape tape = {code, k, sizes[0], sizes[1], sizes[2]};
    Room room = {0};
    prepare(&tape, n, 1, &room);
    room = (Room){calloc(room.used, sizeof(double)), 0};
    Run run = prepare(&tape, n, 1, &room);
    for (int at = 0; at < B; at++) {
        int l = at % LANES;
        if (!l)
            run_block(&run, lower, upper, B, NULL, at, B);
        for (int row = 0; row < tape.outputs; row++) {
            const Value *v = value_of(run.out, row);
            const double *from[] = {v->c, v->p, v->q, v->s, v->lo, v->hi};
            for (int part = 0; part < 6; part++)
                to[part][row * B + at] = from[part][l];
            for (int i = 0; i < n; i++)
                a[(row * n + i) * B + at] = terms_of(v)[i][l];
        }
    }
    free(room.at);
}
"""


@cache
def library() -> ctypes.CDLL:
    """The compiled headers."""
    if COMPILER is None:
        pytest.skip("no C compiler")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "enclose.c"), Path(folder, "enclose.so")
        source.write_text(SOURCE, encoding="utf-8")
        subprocess.run([COMPILER, *FLAGS, str(source), "-o", str(target), "-lm"], check=True, capture_output=True)
        return ctypes.CDLL(str(target))


def enclose(tape: Tape, lower: FloatArray, upper: FloatArray) -> Enclosures:
    """The kernel's enclosures of a tape's results over boxes with ends (n, B)."""
    n, count = lower.shape
    (code, k), *sizes = tape.head
    c, p, q, s, lo, hi = every = [np.empty((tape.outputs, count)) for _ in range(6)]
    a = np.empty((tape.outputs, n, count))
    read = code, k, np.array(sizes, dtype=np.int32), np.ascontiguousarray(lower), np.ascontiguousarray(upper)
    given = [ctypes.c_void_p(each.ctypes.data) for each in read]
    to = (ctypes.c_void_p * 6)(*(each.ctypes.data for each in every))
    library().enclose(n, *given, count, to, ctypes.c_void_p(a.ctypes.data))
    return Enclosures(c, a, p, q, s, lo, hi)
