"""Generated programs of controllers, compiled against headers of ours and called from Python."""

from __future__ import annotations

import ctypes
import importlib
import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from builders import Array
from generated import COMPILERS, run

from screwsynth.nlp import Case
from screwsynth.nlp.embedding.kinematics import Kinematics
from screwsynth.nlp.embedding.targets import export_kinematics

HEADERS = Path(__file__).parents[1] / "controllers"
#: Flags of LinuxCNC's build.
LINUXCNC = [
    "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-Wframe-larger-than=2560", "-fno-builtin-sin",
    "-fno-builtin-cos", "-fno-builtin-sincos",
]  # fmt: skip


class Pose(ctypes.Structure):
    """LinuxCNC's EmcPose."""

    _fields_ = [(name, ctypes.c_double) for name in "xyzabcuvw"]


class Module:
    """Kinematics module of LinuxCNC, compiled and called from Python."""

    def __init__(self, case: Case, folder: Path) -> None:
        files = export_kinematics(case, "", "linuxcnc-module")
        (self.source,) = (name for name in files if name.endswith(".c"))
        (folder / self.source).write_text(files[self.source], encoding="utf-8")
        flags = [*LINUXCNC, f"-I{HEADERS / 'linuxcnc'}"]
        run(COMPILERS[0], *flags, "-c", self.source, "-o", "module.o", where=folder)
        shown = run("nm", "-u", "module.o", where=folder).split()
        self.needed = set(shown) - {"U"}
        same = "(int c) { return c; }"
        hal = f"int hal_init(const char *n) {{ return n != 0; }} int hal_ready{same} int hal_exit{same}"
        (folder / "hal.c").write_text(hal, encoding="utf-8")
        run(COMPILERS[0], *flags, "-shared", "-fPIC", self.source, "hal.c", "-lm", "-o", "module.so", where=folder)
        self.loaded = ctypes.CDLL(str(folder / "module.so"))
        assert self.loaded.rtapi_app_main() == 0
        self.count = len(Kinematics(case).drives)

    def inverse(self, *words: float) -> tuple[int, Array]:
        joints = np.full(16, -77.0)
        return self.loaded.kinematicsInverse(ctypes.byref(Pose(*words)), joints.ctypes, None, None), joints

    def forward(self, joints: Array, *guess: float) -> tuple[int, Array]:
        pose = Pose(*guess)
        status = self.loaded.kinematicsForward(joints.ctypes, ctypes.byref(pose), None, None)
        return status, np.array([getattr(pose, each) for each in "xyzabc"])

    def jacobian(self, *words: float) -> tuple[int, Array]:
        found = np.full((16, 9), -77.0)
        return self.loaded.kinematicsJacobian(None, ctypes.byref(Pose(*words)), found.ctypes, None), found


def klipper(case: Case, folder: Path, patch: pytest.MonkeyPatch) -> tuple[ctypes.CDLL, ModuleType, str]:
    """Return Klipper's step generator as a library, and its class as a module."""
    files = export_kinematics(case, "", "klipper-patch")
    (source,) = (name for name in files if name.endswith(".c"))
    name = source.removeprefix("kin_").removesuffix(".c")
    for file in (source, f"{name}.py"):
        (folder / file).write_text(files[file], encoding="utf-8")
    flags = f"-O2 -Wall -Wextra -Werror -shared -fPIC -I{HEADERS / 'klipper'}".split()
    run("gcc", *flags, source, "-lm", "-o", "steps.so", where=folder)
    library = ctypes.CDLL(str(folder / "steps.so"))
    getattr(library, f"{name}_stepper_alloc").restype = ctypes.c_void_p
    declared = re.findall(r"^    .*?(\w+)\(.*\);$", files["chelper.patch.md"], re.MULTILINE)
    assert len(declared) == 3
    assert all(hasattr(library, each) for each in declared)
    for path in (HEADERS / "klipper", folder):
        patch.syspath_prepend(str(path))
    for module in ("chelper", "stepper", name):
        patch.delitem(sys.modules, module, raising=False)
    importlib.import_module("chelper").libraries.append(library)
    return library, importlib.import_module(name), name


def tool_head(home: Array) -> tuple[Any, Any]:
    """Return Klipper's tool head and configuration, as far as kinematics need them."""
    values = {"homing_start": home.tolist(), "position_min": [-50.0] * 3, "position_max": [50.0] * 3}
    config = SimpleNamespace(
        getsection=lambda name: name,
        get_printer=lambda: SimpleNamespace(register_event_handler=lambda *_: None),
        getfloat=lambda _name, default, **_: default,
        getfloatlist=lambda name, **_: values[name],
        error=ValueError,
    )
    head = SimpleNamespace(get_trapq=lambda: None, get_max_velocity=lambda: (100.0, 1000.0), Coord=lambda *each: each)
    return head, config


class Stepper(ctypes.Structure):
    """Head of Klipper's struct stepper_kinematics in our header."""

    _fields_ = [
        ("commanded", ctypes.c_double),
        ("flags", ctypes.c_int),
        ("callback", ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double)),
    ]
