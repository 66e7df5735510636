"""Programs over the robots of :mod:`screwsynth.models`: the public names, and where each is."""

from .case.case import Case as Case
from .case.limits.limits import Actuator as Actuator
from .case.limits.limits import Cone as Cone
from .case.limits.limits import Footprint as Footprint
from .case.limits.limits import Homogenised as Homogenised
from .case.limits.limits import Interval as Interval
from .case.limits.limits import Limits as Limits
from .case.limits.limits import MountingPose as MountingPose
from .case.pose import Free as Free
from .case.pose import OverPoses as OverPoses
from .case.pose import Pose as Pose
from .case.pose import Rotation as Rotation
from .case.pose import Step as Step
from .case.pose import along_screw as along_screw
from .case.pose import over_grid as over_grid
from .case.reader import case_from_tables as case_from_tables
from .case.reader import load_case as load_case
from .case.reader import shipped_cases as shipped_cases
from .case.robots import build_model as build_model
from .case.settings import Expectation as Expectation
from .case.settings import Published as Published
from .case.settings import Search as Search
from .case.task import Method as Method
from .case.task import Sense as Sense
from .case.task import Task as Task
from .certificate.branchandbound import certify as certify
from .certificate.certificate import Certificate as Certificate
from .certificate.certificate import CertificateStatus as CertificateStatus
from .errors import CaseError as CaseError
from .errors import EvaluationError as EvaluationError
from .errors import InputError as InputError
from .errors import ScrewsynthError as ScrewsynthError
from .errors import UncoveredError as UncoveredError
from .evidence.margins import Margin as Margin
from .evidence.margins import margins_of as margins_of
from .evidence.optimality import ActiveSide as ActiveSide
from .evidence.optimality import Evidence as Evidence
from .evidence.optimality import PointKind as PointKind
from .evidence.optimality import examine as examine
from .evidence.principal_motions import TaskAnalysis as TaskAnalysis
from .evidence.principal_motions import analyse_tasks as analyse_tasks
from .evidence.sensitivity import Sensitivity as Sensitivity
from .evidence.sensitivity import sensitivities as sensitivities
from .evidence.state import RobotState as RobotState
from .evidence.state import evaluate as evaluate
from .evidence.tolerance import ToleranceLoss as ToleranceLoss
from .evidence.tolerance import tolerance_loss as tolerance_loss
from .program.formulation import formulate as formulate
from .program.nlp import Nlp as Nlp
from .program.program import Program as Program
from .results.jsondata import json_data as json_data
from .results.solution import result_of as result_of
from .solve.compromise import Compromise as Compromise
from .solve.compromise import TaskOutcome as TaskOutcome
from .solve.compromise import solve_tasks as solve_tasks
from .solve.ipopt import Start as Start
from .solve.ipopt import StartStatus as StartStatus
from .solve.multistart import Optimum as Optimum
from .solve.multistart import Solution as Solution
from .solve.multistart import Status as Status
from .solve.multistart import solve as solve
from .units import Units as Units

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
    "Homogenised",
    "InputError",
    "Interval",
    "Limits",
    "Margin",
    "Method",
    "MountingPose",
    "Nlp",
    "Optimum",
    "OverPoses",
    "PointKind",
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
    "json_data",
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
