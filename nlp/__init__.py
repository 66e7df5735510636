"""Programs over the robots of :mod:`screwsynth.models`: cases, formulation, solution, evidence and output.

The names below are the public ones. Each is imported when it is first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from screwsynth.nlp.analysis import TaskAnalysis, analyse_tasks
    from screwsynth.nlp.case import Case
    from screwsynth.nlp.casefile import case_from_tables, load_case, shipped_cases
    from screwsynth.nlp.certificate.branchandbound import certify
    from screwsynth.nlp.certificate.certificate import Certificate, CertificateStatus
    from screwsynth.nlp.errors import CaseError, EvaluationError, InputError, ScrewsynthError, UncoveredError
    from screwsynth.nlp.evaluation import RobotState, evaluate
    from screwsynth.nlp.formulation import formulate
    from screwsynth.nlp.ipopt import Start, StartStatus
    from screwsynth.nlp.limits import Actuator, Cone, Footprint, Home, Homogenised, Interval, Limits
    from screwsynth.nlp.margins import Margin, margins_of
    from screwsynth.nlp.optimality import ActiveSide, Evidence, Kind, examine
    from screwsynth.nlp.poses import Step, along_screw, over_grid
    from screwsynth.nlp.program import Nlp, Program
    from screwsynth.nlp.result import result_of
    from screwsynth.nlp.robots import build_model
    from screwsynth.nlp.sensitivity import Sensitivity, sensitivities
    from screwsynth.nlp.solver import Optimum, Solution, Status, solve
    from screwsynth.nlp.tasks import Compromise, TaskOutcome, solve_tasks
    from screwsynth.nlp.tolerance import ToleranceLoss, tolerance_loss
    from screwsynth.nlp.units import Units
    from screwsynth.nlp.values import (
        Expectation,
        Free,
        Method,
        OverPoses,
        Pose,
        Published,
        Rotation,
        Search,
        Sense,
        Task,
    )

__all__ = [
    "ActiveSide",
    "Actuator",
    "Case",
    "CaseError",
    "Certificate",
    "CertificateStatus",
    "Compromise",
    "Cone",
    "EvaluationError",
    "Evidence",
    "Expectation",
    "Footprint",
    "Free",
    "Home",
    "Homogenised",
    "InputError",
    "Interval",
    "Kind",
    "Limits",
    "Margin",
    "Method",
    "Nlp",
    "Optimum",
    "OverPoses",
    "Pose",
    "Program",
    "Published",
    "RobotState",
    "Rotation",
    "ScrewsynthError",
    "Search",
    "Sense",
    "Sensitivity",
    "Solution",
    "Start",
    "StartStatus",
    "Status",
    "Step",
    "Task",
    "TaskAnalysis",
    "TaskOutcome",
    "ToleranceLoss",
    "UncoveredError",
    "Units",
    "along_screw",
    "analyse_tasks",
    "build_model",
    "case_from_tables",
    "certify",
    "evaluate",
    "examine",
    "formulate",
    "load_case",
    "margins_of",
    "over_grid",
    "result_of",
    "sensitivities",
    "shipped_cases",
    "solve",
    "solve_tasks",
    "tolerance_loss",
]

_HOMES = {
    "case": ("Case",),
    "values": (
        "Expectation",
        "Free",
        "Method",
        "OverPoses",
        "Pose",
        "Published",
        "Rotation",
        "Search",
        "Sense",
        "Task",
    ),
    "robots": ("build_model",),
    "certificate.certificate": ("Certificate", "CertificateStatus"),
    "certificate.branchandbound": ("certify",),
    "casefile": ("case_from_tables", "load_case", "shipped_cases"),
    "errors": ("CaseError", "EvaluationError", "InputError", "ScrewsynthError", "UncoveredError"),
    "evaluation": ("RobotState", "evaluate"),
    "formulation": ("formulate",),
    "limits": ("Actuator", "Cone", "Footprint", "Home", "Homogenised", "Interval", "Limits"),
    "margins": ("Margin", "margins_of"),
    "poses": ("Step", "along_screw", "over_grid"),
    "sensitivity": ("Sensitivity", "sensitivities"),
    "tolerance": ("ToleranceLoss", "tolerance_loss"),
    "optimality": ("ActiveSide", "Evidence", "Kind", "examine"),
    "program": ("Nlp", "Program"),
    "result": ("result_of",),
    "ipopt": ("Start", "StartStatus"),
    "solver": ("Optimum", "Solution", "Status", "solve"),
    "tasks": ("Compromise", "TaskOutcome", "solve_tasks"),
    "analysis": ("TaskAnalysis", "analyse_tasks"),
    "units": ("Units",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    """Import a public name when it is first used."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value
