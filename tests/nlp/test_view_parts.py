"""Long functions of the live view's C in parts: the same values, from the same statements."""

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Array
from generated import COMPILERS

from screwsynth.nlp.embedding.templates import casadi_texts
from screwsynth.nlp.view.parts import in_parts


def long_function(count: int) -> ca.Function:
    """A function of many operations: values are used again soon and late, and results are written all along."""
    rng, x = np.random.default_rng(5), ca.SX.sym("x", 4)
    values, results = [x[k] for k in range(4)], []
    for k in range(count):
        near, far = (values[-int(rng.integers(1, 5))], values[int(rng.integers(0, len(values)))])
        values.append(ca.sin(near) * 0.9 + far * float(rng.uniform(-0.4, 0.4)))
        if k % 50 == 0:
            results.append(values[-1])
    return ca.Function("chain", [x], [ca.vertcat(*results), ca.sumsqr(ca.vertcat(*values[-9:]))])


def built(folder: Path, text: str, header: str) -> Callable[[Array], list[Array]]:
    """The function from C, compiled."""
    folder.mkdir()
    (folder / "chain.c").write_text(text)
    (folder / "chain.h").write_text(header)
    words = [COMPILERS[0], "-O1", "-shared", "-fPIC", "-ffp-contract=off", "chain.c", "-lm", "-o", "chain.so"]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)
    function = ctypes.CDLL(str(folder / "chain.so")).chain
    pointer = ctypes.POINTER(ctypes.c_double)

    def call(x: Array) -> list[Array]:
        results = [np.zeros(60), np.zeros(1)]
        given = (pointer * 1)(x.ctypes.data_as(pointer))
        places = (pointer * 2)(*(each.ctypes.data_as(pointer) for each in results))
        assert function(given, places, None, None, 0) == 0
        return results

    return call


@pytest.mark.skipif(not COMPILERS, reason="no C compiler is installed")
def test_parts_have_the_values_of_the_whole(tmp_path: Path) -> None:
    texts = casadi_texts([long_function(3000)], "chain")
    text = in_parts(texts[".c"])
    assert text.count("noinline)) static void casadi_f0_part") > 3
    longest = max(len(part.splitlines()) for part in text.split("\n}\n"))
    assert longest < 0.5 * texts[".c"].count("\n")
    whole = built(tmp_path / "whole", texts[".c"], texts[".h"])
    parts = built(tmp_path / "parts", text, texts[".h"])
    for x in np.random.default_rng(6).normal(size=(5, 4)):
        for ours, theirs in zip(parts(x), whole(x), strict=True):
            assert (ours == theirs).all()
            assert np.isfinite(theirs).all()
            assert theirs.any()


def test_other_functions_stay_as_they_are() -> None:
    short = casadi_texts([long_function(100)], "chain")[".c"]
    assert in_parts(short) == short
    x = ca.MX.sym("x", 4)
    # A loop is no list of assignments.
    mapped = ca.Function("chain", [x], [long_function(3000).map(2)(ca.horzcat(x, x))[0]])
    text = casadi_texts([mapped], "chain")[".c"]
    head = text[text.index("static int casadi_f0") : text.index("\n}\n", text.index("static int casadi_f0"))]
    assert head in in_parts(text)
