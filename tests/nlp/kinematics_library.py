"""Generated kinematics as a shared library: compiled, and called from Python."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from builders import Array
from generated import COMPILERS, STRICT

from screwsynth.nlp import Case, Rotation, Task, build_model
from screwsynth.nlp.embedding.kinematics import Kinematics, matrix_of_rpy
from screwsynth.nlp.embedding.kinematicsfiles import generate_kinematics, kinematics_prefix
from screwsynth.nlp.units import Units

#: Statuses, in the order of the header.
OK, OUT_OF_REACH, LOOPS_OPEN, OTHER_ASSEMBLY, SINGULAR, NOT_CONVERGED, BAD_INPUT = range(7)


def typical_case(name: str, **changes: Any) -> Case:  # noqa: ANN401 - fields of a case
    """Return a case of a robot with its typical dimensions."""
    model = build_model(name)
    dimensions = {each.name: each.typical if len(each.typical) > 1 else each.typical[0] for each in model.parameters}
    given = {"units": Units(angle="rad"), "name": name, "rotation": Rotation(), **changes}
    return Case(model, dimensions, model.home, [Task(np.array([0, 0, 0, 0, 0, 1.0]))], **given)


class Answer(NamedTuple):
    """Status of a call, and its results."""

    status: int
    values: Array


class Library:
    """Kinematics of a case in C, called from Python."""

    def __init__(self, case: Case, *, single: bool = False, coordinates: str = "pose", optimise: str = "-O2") -> None:
        self.case, self.robot = case, Kinematics(case)
        self.kin = kinematics_prefix(case.name)
        self.files = generate_kinematics(case, "", single=single, coordinates=coordinates)
        self.folder = Path(tempfile.mkdtemp())
        for name, text in self.files.items():
            (self.folder / name).write_text(text, encoding="utf-8")
        sources = [name for name in self.files if name.endswith(".c") and "kinematics" in name]
        flags = [*STRICT.split(), optimise, "-shared", "-fPIC"]
        command = [COMPILERS[0], *flags, *sources, "-lm", "-o", "library.so"]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self._loaded = ctypes.CDLL(str(self.folder / "library.so"))
        self.type = np.float32 if single else np.float64
        self.count = len(self.robot.drives)
        self.state = np.zeros(12 + self.robot.unknowns) if self.robot.unknowns else None
        self.start()

    def start(self) -> None:
        """Set the state to home."""
        if self.state is not None:
            self.call("start", self.state)

    def call(self, name: str, *arguments: object) -> int:
        pointers = [ctypes.c_void_p(each.ctypes.data) if isinstance(each, np.ndarray) else each for each in arguments]
        return int(getattr(self._loaded, f"{self.kin}_{name}")(*pointers))

    def at(self, name: str, p: Array, R: Array, size: int, *further: Array) -> Answer:
        """Return the result of a function of the pose; it is -77 where the call leaves it unchanged."""
        found = np.full(size, -77.0, self.type)
        pose = [np.array(p, self.type), np.array(R, self.type).reshape(9)]
        own = [] if self.state is None else [self.state]
        return Answer(self.call(name, *pose, *own, *[np.array(each, self.type) for each in further], found), found)

    def motors(self, p: Array, R: Array) -> Answer:
        """Return the actuator coordinates."""
        return self.at("motors", p, R, self.count)

    def forward(self, q: Array, p: Array, R: Array) -> tuple[int, Array, Array]:
        """Return status, position and rotation of forward kinematics from a guess."""
        position, rotation = np.array(p, self.type), np.array(R, self.type).reshape(9)
        own = [] if self.state is None else [self.state]
        iterations = np.zeros(1, np.int32)
        status = self.call("forward", np.array(q, self.type), position, rotation, *own, iterations)
        return status, position, rotation.reshape(3, 3)

    def complete(self, p: Array, R: Array) -> tuple[int, Array, Array]:
        """Return status, position and rotation with dependent coordinates."""
        position, rotation = np.array(p, self.type), np.array(R, self.type).reshape(9)
        own = [] if self.state is None else [self.state]
        return self.call("complete", position, rotation, *own), position, rotation.reshape(3, 3)

    @property
    def home(self) -> tuple[Array, Array]:
        """Position and rotation at home."""
        return self.robot.home[9:12].copy(), self.robot.home[:9].reshape(3, 3).copy()

    def poses(self, count: int, spread: float, seed: int = 0) -> tuple[Array, Array]:
        """Return random poses about home, with changes of the independent coordinates alone."""
        rng = np.random.default_rng(seed)
        steps = np.where(np.isin(range(6), self.robot.coordinates), rng.uniform(-1, 1, (count, 6)) * spread, 0.0)
        p, R = self.home
        return p + self.robot.size * steps[:, :3], np.array([matrix_of_rpy(*each) @ R for each in 2 * steps[:, 3:]])
