"""All files of an exported robot."""

from __future__ import annotations

from collections.abc import Collection

from ....models import Dimension
from ...errors import InputError, nearest
from ..solved.mechanism_of import Exported
from .mjcf import mjcf_text
from .plates import Plate, dxf_text, plate_of, plates_csv, required_dxf
from .readme import readme_text
from .tables import joints_csv, links_csv
from .urdf import urdf_of

#: The formats that can be asked for.
FORMATS = ("mjcf", "urdf", "csv", "dxf")


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
    if "csv" in chosen or "dxf" in chosen:
        plates = tuple(plate_of(mechanism, link, exported.size) for link in (mechanism.base, mechanism.platform))
        files["plates.csv"] = plates_csv(plates, units)
    if "dxf" in chosen:
        for plate in plates:
            files[f"{plate.name}.dxf"] = dxf_text(plate, units.label(Dimension.LENGTH))
    return {"README.md": readme_text(exported, list(files), plates if "dxf" in chosen else ()), **files}
