"""What the tests of the command line, and those of generated C, share."""

import contextlib
import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Run
from generated import COMPILERS, OPTIMISED, STRICT
from pages import page, page_file  # noqa: F401 - fixtures of all tests of pages

from screwsynth.nlp import Case, Nlp, generate_c, load_case
from screwsynth.nlp.cli.main import run as command_line
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.program.sampling import starting_points

THREE_POSES = """
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = { min = 5, max = 20 } }
[[pose]]
position = [0, 0, 30]
[[pose]]
position = [6, 0, 33]
[[pose]]
position = [0, 5, 24]
[[task]]
sense = "SENSE"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
[solve]
starts = 2
"""


@pytest.fixture
def three_poses() -> Callable[[str], str]:
    """The text of a case with three poses, by the sense of its task."""
    return lambda sense: THREE_POSES.replace("SENSE", sense)


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """The command line in this process: exit status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["screwsynth", *arguments])
        capfd.readouterr()
        code = command_line()
        out, err = capfd.readouterr()
        return code, out, err

    return run


@dataclass
class Solved:
    """What the solver in C returned."""

    status: int
    F: float
    x: np.ndarray
    R: np.ndarray
    axis: np.ndarray
    angle: float
    violation: float
    residual: float
    runs: int
    converged: int
    iterations: int
    lower_multipliers: np.ndarray
    upper_multipliers: np.ndarray
    g_lower_multipliers: np.ndarray
    g_upper_multipliers: np.ndarray


#: Type of the callback that may end a solve.
Deadline = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
MULTIPLIERS = ("lower_multipliers", "upper_multipliers", "g_lower_multipliers", "g_upper_multipliers")


#: The first compiler there is; empty without one.
COMPILER = next(iter(COMPILERS), "")


def built(files: Mapping[str, str], root: Path, level: str) -> Path:
    """Return a folder of C with its objects and its shared library, compiled once for all processes of the tests."""
    folder = root / hashlib.sha256(repr((level, sorted(files.items()))).encode()).hexdigest()[:32]
    if folder.exists():
        return folder
    making = Path(tempfile.mkdtemp(dir=root))
    for name, text in files.items():
        (making / name).write_text(text, encoding="utf-8")
    command = ["make", "-C", str(making), f"CC={COMPILER}", f"CFLAGS={STRICT} {level} -fPIC", "library"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    objects = [str(path) for path in sorted(making.glob("*.o"))]
    subprocess.run([COMPILER, "-shared", *objects, "-lm", "-o", str(making / "all.so")], check=True)
    # Another process may have been faster: then its folder is taken.
    with contextlib.suppress(OSError):
        making.rename(folder)
    return folder


class Embedded:
    """The C of a case, compiled and loaded."""

    def __init__(self, case: Case, root: Path, level: str = "-O1") -> None:
        files = generate_c(case, "")
        self.prefix = identifier(case.name)
        self.header = files[f"{self.prefix}.h"]
        #: Folder with the files, the objects of the library and the library, which tests may share: not to be changed.
        self.folder = built(files, root, level)
        self._library = ctypes.CDLL(str(self.folder / "all.so"))
        self.n, self.c, self.p = self.macro("N"), self.macro("C"), self.macro("P")
        pointer, number, integer = ctypes.c_void_p, ctypes.c_double, ctypes.c_int

        class Options(ctypes.Structure):
            _fields_ = (("max_iterations", integer), ("deadline", Deadline), ("user", pointer))

        class Problem(ctypes.Structure):
            _fields_ = (
                *((name, pointer) for name in ("p", "x0", "lower", "upper", "g_lower", "g_upper")),
                *((name, integer) for name in ("maximise", "seeds")),
                ("options", Options),
            )

        class Result(ctypes.Structure):
            _fields_ = (
                ("F", number),
                ("x", number * (self.n + 1)),
                ("R", number * 9),
                ("axis", number * 3),
                *((name, number) for name in ("angle", "violation", "residual")),
                *((name, integer) for name in ("runs", "converged", "iterations")),
                *((name, number * (self.n + 1)) for name in MULTIPLIERS[:2]),
                *((name, number * (self.c + 1)) for name in MULTIPLIERS[2:]),
            )

        self._problem, self._result = Problem, Result
        # Room behind what the header asks for, filled with a mark, shows where too much is written.
        self._work = np.full(self.macro("SOLVERWORK") + 64, 1234.5)
        self._iwork = np.full(self.macro("SOLVERIWORK") + 64, 12345, dtype=np.intc)

    def macro(self, name: str) -> int:
        (value,) = re.findall(rf"#define {self.prefix.upper()}_{name} (\d+)", self.header)
        return int(value)

    def call(self, function: str, *arguments: np.ndarray | int) -> int:
        given = [each if isinstance(each, int) else _address(each) for each in arguments]
        return int(getattr(self._library, f"{self.prefix}_{function}")(*given))

    def curvature(self, x: np.ndarray, k: np.ndarray, multipliers: np.ndarray, work: np.ndarray) -> np.ndarray:
        """Hessian (n, n) of the Lagrangian at a point, with the weight 0.7 of F."""
        H, weight = np.zeros((self.n, self.n)), np.array([0.7])
        given = np.array([each.ctypes.data for each in (x, k, weight, multipliers)], dtype=np.uintp)
        made = np.array([H.ctypes.data], dtype=np.uintp)
        assert self.call("SQP_curvature", given, made, work) == 0
        return H

    def compare(self, nlp: Nlp, count: int, close: float = 1e-14) -> None:
        """Compare every function with the program's own, at random points."""
        p, kernels, n = np.ascontiguousarray(nlp.arguments), nlp.program.kernels, nlp.n
        m, limits = len(nlp.program.model.frame_rows), len(nlp.program.constraints)
        tasks, legs, poses = self.macro("POSETASKS"), self.macro("LEGS"), self.macro("POSES")
        k, work = np.zeros(self.macro("K") + 1), np.zeros(self.macro("WORK"))
        F, gradient, hessian = np.zeros(1), np.zeros(n), np.zeros((n, n))
        J, rates, g, dg = np.zeros((m, 6)), np.zeros((m, tasks)), np.zeros(limits), np.zeros((limits, n))
        R, axis, angle, each = np.zeros((3, 3)), np.zeros(3), np.zeros(1), np.zeros(tasks)
        lengths, base, platform, matrix = np.zeros(legs), np.zeros((legs, 3)), np.zeros((legs, 3)), np.zeros((4, 4))
        assert self.call("prepare", p, k, work) == 0
        terms = _hessian_terms(nlp) if tasks * poses == 1 and n else None
        for i, x in enumerate(_random_points(nlp, count)):
            pose, at = i % poses, ([i % poses] if poses > 1 else [])
            assert self.call("F", x, k, F, work) == 0
            alone = F[0]
            assert self.call("F_gradient", x, k, F, gradient, work) == 0
            assert F[0] == alone
            assert self.call("F_hessian", x, k, F, gradient, hessian, work) == 0
            assert self.call("jacobian", x, k, *at, J, work) == self.call("rates", x, k, *at, rates, work) == 0
            assert self.call("limits", x, k, g, dg, work) == self.call("rotation", x, k, *at, R, axis, angle, work) == 0
            assert self.call("geometry", x, k, *at, lengths, base, platform, matrix, work) == 0
            value, slope, constraint, constraint_slope = kernels.derivatives(x, p)
            second = kernels.hessian(x, p, 1.0, np.zeros(limits))
            state, robot = kernels.robot_states[pose](x, p), nlp.program.robots[pose]
            pairs = [(F, value.ravel()), (gradient, slope.ravel()), (hessian, second), (J, state.jacobian)]
            pairs += [(rates, state.rates), (g, constraint.ravel()), (dg, constraint_slope), (R, state.rotation)]
            pairs += [(matrix[:3], np.hstack([state.rotation, state.position])), (matrix[3], np.array([0, 0, 0, 1.0]))]
            if tasks * poses > 1:
                assert self.call("F_of_tasks", x, k, *at, each, work) == 0
                pairs.append((each, state.F.ravel()))
            if legs and i < 20:
                ends = [ca.horzcat(*[part for leg in robot.legs for part in (leg.base, leg.base + leg.span)])]
                ends = ca.Function("ends", [nlp.program.x, nlp.program.p], ends)(x, p).full().T
                pairs += [(base, ends[::2]), (platform, ends[1::2])]
                pairs.append((lengths, np.linalg.norm(ends[1::2] - ends[::2], axis=1)))
            # The same operations: a compiler may still contract or reorder the last digit.
            for got, wanted in pairs:
                if got.size:
                    size = max(1.0, float(np.max(np.abs(wanted))))
                    if got is hessian and terms is not None:
                        # The rows' terms may be added in another order.
                        size = max(size, float(np.max(terms(x, p).full())))
                    assert np.max(np.abs(got - wanted)) <= close * size
            turned = np.eye(3) + np.sin(angle[0]) * _cross(axis) + (1 - np.cos(angle[0])) * _cross(axis) @ _cross(axis)
            assert np.max(np.abs(turned - R)) <= 1e-13

    def solve(
        self,
        *,
        maximise: int | None = None,
        seeds: int | None = None,
        max_iterations: int = 0,
        deadline: Callable[[], bool] | None = None,
        **arrays: np.ndarray,
    ) -> Solved:
        """Solve the default problem with some of its arrays replaced. What the C leaves as it was is -7."""
        problem, result = self._problem(), self._result()
        result.F = -7.0
        result.x[:] = [-7.0] * len(result.x)
        getattr(self._library, f"{self.prefix}_defaults")(ctypes.byref(problem))
        kept = {name: np.ascontiguousarray(array, dtype=np.float64) for name, array in arrays.items()}
        for name, array in kept.items():
            setattr(problem, name, _address(array))
        if maximise is not None:
            problem.maximise = maximise
        if seeds is not None:
            problem.seeds = seeds
        problem.options.max_iterations = max_iterations
        callback = Deadline(lambda _: int(deadline())) if deadline else Deadline()
        problem.options.deadline = callback
        return self._solved(problem, result)

    def solve_again(self) -> Solved:
        """Solve the default problem, and again from the result's own x, into the same result."""
        problem, result = self._problem(), self._result()
        getattr(self._library, f"{self.prefix}_defaults")(ctypes.byref(problem))
        self._solved(problem, result)
        problem.x0, problem.seeds = ctypes.addressof(result) + self._result.x.offset, 0
        return self._solved(problem, result)

    def _solved(self, problem: ctypes.Structure, result: ctypes.Structure) -> Solved:
        solve = getattr(self._library, f"{self.prefix}_solve")
        status = solve(ctypes.byref(problem), ctypes.byref(result), _address(self._work), _address(self._iwork))
        assert (self._work[-64:] == 1234.5).all()
        assert (self._iwork[-64:] == 12345).all()
        names = ("angle", "violation", "residual", "runs", "converged", "iterations")
        scalars = {name: getattr(result, name) for name in names}
        arrays_out = {name: np.array(getattr(result, name)) for name in ("R", "axis")}
        arrays_out |= {name: np.array(getattr(result, name))[:-1] for name in MULTIPLIERS}
        return Solved(status, result.F, np.array(result.x)[: self.n], **arrays_out, **scalars)


def _hessian_terms(nlp: Nlp) -> ca.Function:
    """Return the sizes of the terms of F's Hessian, one for each row, as a sum."""
    program = nlp.program
    rates = ca.vertsplit(program.robots[0].rates[:, 0])
    sizes = [ca.fabs(ca.hessian(rate**2, program.x)[0]) for rate in rates]
    return ca.Function("terms", [program.x, program.p], [ca.densify(sum(sizes[1:], sizes[0]))])


def _random_points(nlp: Nlp, count: int) -> list[np.ndarray]:
    return [np.ascontiguousarray(x) for x in starting_points(nlp, count + 1, 7)[1:]] if nlp.n else [nlp.start]


def _cross(u: np.ndarray) -> np.ndarray:
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


@pytest.fixture(scope="session")
def embed(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Embedded]:
    """The C of any case."""
    if not COMPILER or not shutil.which("make"):
        pytest.skip("no C compiler or no make is installed")
    # Processes of pytest-xdist have folders of their own in a common one.
    base = tmp_path_factory.getbasetemp()
    root = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "compiled"
    root.mkdir(exist_ok=True)
    return lambda case, level="-O1": Embedded(case, root, level)


@pytest.fixture(scope="session")
def embedded(embed: Callable[..., Embedded]) -> Callable[[str], Embedded]:
    """The C of a shipped case, made once."""
    return cache(lambda name: embed(load_case(name), "-O2" if name in OPTIMISED else "-O1"))


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Chromium without a window, drawing 3-D in software."""
    chromium, driver = Path("/usr/bin/chromium"), Path("/usr/bin/chromedriver")
    if not (chromium.exists() and driver.exists()):
        pytest.skip("Debian's chromium and chromium-driver are not installed")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(chromium)
    switches = ["headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-dev-shm-usage"]
    switches += ["disable-background-networking", "disable-component-update", "disable-sync", "window-size=1280,1000"]
    switches += ["use-gl=angle", "use-angle=swiftshader", "enable-unsafe-swiftshader"]
    switches += [f"user-data-dir={tmp_path_factory.mktemp('chromium')}"]
    for switch in switches:
        options.add_argument(f"--{switch}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    service = webdriver.chrome.service.Service(str(driver))
    chrome = webdriver.Chrome(options=options, service=service)
    # A busy machine is waited for.
    chrome.set_page_load_timeout(600)
    chrome.set_script_timeout(600)
    yield chrome
    chrome.quit()
