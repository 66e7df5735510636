"""Export of a solved case to files for other programs."""

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
from ..program.layout import refuse_over_path
from ..program.nlp import Nlp
from .solved.mechanism_of import Exported, mechanism_of
from .writing.cutlist import cut_list_csv, drawn_links
from .writing.mjcf import mjcf_text
from .writing.plates import Plate, dxf_text, plate_of, plates_csv, required_dxf
from .writing.readme import readme_text
from .writing.tables import joints_csv, links_csv
from .writing.urdf import urdf_of

#: Names of the formats.
FORMATS = ("mjcf", "urdf", "csv", "dxf")
#: Largest difference of J'J between a result and its recomputed robot, relative to the largest entry: loops of results
#: are closed to the solver's accuracy, and another assembly mode differs by order 1.
_SAME = 1e-6

if TYPE_CHECKING:
    from ..solver.solution import Solution


def export_robot(solution: Solution, formats: Collection[str] = ("all",), *, pose: int = 1) -> dict[str, str]:
    """Return the files of a solved robot for other programs, as text by file name.

    Args:
        solution: solution of a case.
        formats: one or more of ``mjcf``, ``urdf``, ``csv`` and ``dxf``; or ``all``.
        pose: number of the pose, from 1.

    Returns:
        Text of each file by name, with a ``README.md`` about frames, units and assumptions. Lengths are in the unit of
        the case.

    Raises:
        InputError: the solve has no result, there is no such pose or format, the joints of the robot's limbs are not
            known, or ``dxf`` is requested without ezdxf.
        EvaluationError: the loops of the robot cannot be closed.
    """
    check_formats(formats)
    check_pose(solution.case, pose)
    if not solution.status.is_answer:
        fault = f"the solve of {solution.case.name!r} ended as {solution.status.value}"
        raise InputError(f"{fault}, without a design to export; only a feasible result can be exported")
    nlp, x, index = solution.at_pose(pose - 1)
    return files_at(nlp, x, formats, index + 1)


def files_at(nlp: Nlp, x: FloatArray, formats: Collection[str], pose: int) -> dict[str, str]:
    """Return the files of the robot at a point of its nonlinear program; see :func:`export_robot`.

    Args:
        nlp: nonlinear program of a task.
        x: (n,) point of the program.
        formats: one or more of ``mjcf``, ``urdf``, ``csv`` and ``dxf``; or ``all``.
        pose: number of the pose, from 1.

    Raises:
        InputError: the joints of the robot's limbs are not known, or a format does not support the robot.
        EvaluationError: the loops of the robot cannot be closed.
    """
    try:
        return exported_files(mechanism_of(nlp, x, pose), formats)
    except MechanismError as error:
        raise InputError(f"robot {nlp.program.model.name!r} cannot be exported: {error}") from None


def fixed_point(case: Case, joints: Mapping[str, float]) -> tuple[Nlp, FloatArray] | None:
    """Return the program of the first task and its only point, for a case without free variables; otherwise None.

    Args:
        case: the case.
        joints: values of free actuator coordinates by the names of their variables.

    Raises:
        CaseError: the case is optimised along its path, so it has no single robot.
    """
    refuse_over_path(case)
    values = [value for name in case.parameters for value in case.components(name)]
    values += [value for pose in case.poses for value in (*pose.position, pose.rotation.angle)]
    if case.changes or any(isinstance(value, Free) for value in values) or (case.model.free_joints and not joints):
        return None
    nlp = begun_at(formulate(case), joints)
    return nlp, closed_start(nlp)


def check_same_robot(nlp: Nlp, x: FloatArray, jacobian: FloatArray) -> None:
    """Refuse a point whose Jacobian differs from that of a result.

    J'J is compared, because it gives F for every twist and does not depend on the basis of the wrenches of a member.

    Args:
        nlp: the nonlinear program.
        x: (n,) point of the program.
        jacobian: (m, 6) Jacobian of the result, at the first pose.

    Raises:
        InputError: the point has another Jacobian.
    """
    J = evaluate(nlp, x).jacobian
    # Forces and moments are divided by their largest entries, so that J'J has no unit.
    scale = np.repeat([np.abs(jacobian[:, :3]).max() or 1.0, np.abs(jacobian[:, 3:]).max() or 1.0], 3)
    again, given = ((each / scale).T @ (each / scale) for each in (J, jacobian))
    if J.shape != jacobian.shape or not np.abs(again - given).max() <= _SAME * np.abs(given).max():
        fault = "the result is of another assembly mode than the home assembly mode, or of another version of the case"
        raise InputError(f"{fault}: export the case without --of")


def check_pose(case: Case, pose: int) -> None:
    """Refuse a pose that a case does not have.

    Raises:
        InputError: the case has fewer poses.
    """
    if not 1 <= pose <= case.pose_count:
        raise InputError(
            f"--pose {pose}: no such pose; the case has {case.pose_count} pose{'s' * (case.pose_count > 1)}"
        )


def check_formats(formats: Collection[str]) -> tuple[str, ...]:
    """Return the requested formats without duplicates; ``all`` stands for all formats.

    Raises:
        InputError: there is no such format, or a library that it needs is not installed.
    """
    for name in formats:
        if name not in (*FORMATS, "all"):
            raise InputError(f"--format {name}: no such format; {nearest(name, (*FORMATS, 'all'))}")
    chosen = tuple(name for name in FORMATS if name in formats or "all" in formats)
    if "dxf" in chosen:
        required_dxf()
    return chosen


def exported_files(exported: Exported, formats: Collection[str]) -> dict[str, str]:
    """Return the text of each file of a robot by name, with a README that explains them.

    Args:
        exported: the robot as a mechanism.
        formats: one or more of ``mjcf``, ``urdf``, ``csv`` and ``dxf``; or ``all``.

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
