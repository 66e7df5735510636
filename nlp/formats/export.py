"""The files of a solved case for other programs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension, FloatArray
from ...models.mechanism import MechanismError
from ..case.case import Case
from ..case.pose import Free
from ..errors import InputError, nearest
from ..evidence.closing import closed_start
from ..evidence.state import evaluate
from ..program.formulation import formulate
from ..program.free_joints import begun_at
from ..program.nlp import Nlp
from .solved.mechanism_of import Exported, mechanism_of
from .writing.cutlist import cut_list_csv, drawn_links
from .writing.mjcf import mjcf_text
from .writing.plates import Plate, dxf_text, plate_of, plates_csv, required_dxf
from .writing.readme import readme_text
from .writing.tables import joints_csv, links_csv
from .writing.urdf import urdf_of

#: The formats that can be asked for.
FORMATS = ("mjcf", "urdf", "csv", "dxf")
#: Largest difference of J'J of a result from that of its numbers, in parts of its largest entry: results are closed to
#: the solver's accuracy, and another assembly of the joints differs by parts of 1.
_SAME = 1e-6

if TYPE_CHECKING:
    from ..solver.solution import Solution


def export_robot(solution: Solution, formats: Collection[str] = ("all",), *, pose: int = 1) -> dict[str, str]:
    """Return the files of a solved robot for other programs, as text by file name.

    Args:
        solution: the answer to a case.
        formats: ``mjcf``, ``urdf``, ``csv`` and ``dxf``, any of them; or ``all``.
        pose: number of the pose, from 1.

    Returns:
        The texts, with a ``README.md`` of frames, units and choices. Lengths are in the unit of the case.

    Raises:
        InputError: the solve gave no answer, the case has no such pose, there is no such format, the joints of the
            robot's limbs are not known, or ``dxf`` is asked for and ezdxf is not installed.
        EvaluationError: a loop of the robot is open.
    """
    check_formats(formats)
    check_pose(solution.case, pose)
    if not solution.status.is_answer:
        raise InputError(f"the solve of {solution.case.name!r} is {solution.status.value}: there is nothing to export")
    return files_at(solution.outcomes[0].own.nlp, solution.x, formats, pose)


def files_at(nlp: Nlp, x: FloatArray, formats: Collection[str], pose: int) -> dict[str, str]:
    """Return the files of the robot at a point of its program; the rest is as for :func:`export_robot`.

    Args:
        nlp: the program of a task.
        x: (n,) the point.
        formats: as for :func:`export_robot`.
        pose: as for :func:`export_robot`.

    Raises:
        InputError: the joints of the robot's limbs are not known, or a format needs more than the robot has.
        EvaluationError: a loop of the robot is open.
    """
    try:
        return exported_files(mechanism_of(nlp, x, pose), formats)
    except MechanismError as error:
        raise InputError(f"robot {nlp.program.model.name!r} cannot be exported: {error}") from None


def fixed_point(case: Case, joints: Mapping[str, float]) -> tuple[Nlp, FloatArray] | None:
    """Return the program of the first task and its point where nothing of a case is free; None where something is.

    Args:
        case: the case.
        joints: positions of driven joints that the pose does not determine, by the names of their variables.
    """
    values = [value for name in case.parameters for value in case.components(name)]
    values += [value for pose in case.poses for value in (*pose.position, pose.rotation.angle)]
    if any(isinstance(value, Free) for value in values) or (case.model.free_joints and not joints):
        return None
    nlp = begun_at(formulate(case), joints)
    return nlp, closed_start(nlp)


def check_same_robot(nlp: Nlp, x: FloatArray, jacobian: FloatArray) -> None:
    """Refuse a point whose Jacobian is not that of a result, up to the basis of the wrenches of a member.

    F of every twist follows from J'J, which no choice of orthonormal wrenches within a member changes.

    Args:
        nlp: the program.
        x: (n,) the point.
        jacobian: (m, 6) of the result, at the first pose.

    Raises:
        InputError: the same numbers give another Jacobian.
    """
    J = evaluate(nlp, x).jacobian
    # Moments in parts of their largest entry: J'J then has no units.
    scale = np.repeat([np.abs(jacobian[:, :3]).max() or 1.0, np.abs(jacobian[:, 3:]).max() or 1.0], 3)
    own, other = ((each / scale).T @ (each / scale) for each in (J, jacobian))
    if J.shape != jacobian.shape or not np.abs(own - other).max() <= _SAME * np.abs(other).max():
        fault = "another assembly of its joints than the path from home leads to, or of another version of the case"
        raise InputError(f"the result is of {fault}: export the case without it")


def check_pose(case: Case, pose: int) -> None:
    """Refuse a pose that a case does not have.

    Raises:
        InputError: the case has fewer poses.
    """
    if not 1 <= pose <= case.pose_count:
        raise InputError(f"--pose {pose}: the case has {case.pose_count} pose{'s' * (case.pose_count > 1)}")


def check_formats(formats: Collection[str]) -> tuple[str, ...]:
    """Return the formats that are asked for, each once; ``all`` is all of them.

    Raises:
        InputError: there is no such format, or a library that it needs is not installed.
    """
    for name in formats:
        if name not in (*FORMATS, "all"):
            raise InputError(f"--format {name}: is no format; {nearest(name, (*FORMATS, 'all'))}")
    chosen = tuple(name for name in FORMATS if name in formats or "all" in formats)
    if "dxf" in chosen:
        required_dxf()
    return chosen


def exported_files(exported: Exported, formats: Collection[str]) -> dict[str, str]:
    """Return the texts of the files of a robot by name, with a page that explains them.

    Args:
        exported: the robot.
        formats: ``mjcf``, ``urdf``, ``csv``, ``dxf``, or ``all``.

    Raises:
        InputError: there is no such format, or a library that it needs is not installed.
        MechanismError: the robot's links are not connected.
    """
    chosen = check_formats(formats)
    mechanism, units = exported.mechanism, exported.case.units
    files: dict[str, str] = {}
    plates: tuple[Plate, ...] = ()
    if "mjcf" in chosen:
        files["robot.xml"] = mjcf_text(mechanism)
    if "urdf" in chosen:
        urdf = urdf_of(mechanism)
        files["robot.urdf"], files["robot.yaml"] = urdf.text, urdf.loops_text(mechanism)
    if "csv" in chosen:
        files["joints.csv"] = joints_csv(mechanism, exported.joints, units)
        files["links.csv"] = links_csv(mechanism, units)
        files["cut-list.csv"] = cut_list_csv(mechanism, exported.travels, exported.size, units)
    if "csv" in chosen or "dxf" in chosen:
        plates = tuple(plate_of(mechanism, link, exported.size) for link in (mechanism.base, mechanism.platform))
        files["plates.csv"] = plates_csv(plates, units)
    if "dxf" in chosen:
        plates += tuple(plate_of(mechanism, link, exported.size) for link in drawn_links(mechanism, exported.size))
        for plate in plates:
            files[f"{plate.name}.dxf"] = dxf_text(plate, units.label(Dimension.LENGTH))
    return {"README.md": readme_text(exported, list(files), plates if "dxf" in chosen else ()), **files}
