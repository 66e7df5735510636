"""Robots by name: those of this package, and those of other packages.

Another package offers a robot by an entry point in the group ``screwsynth.models``: its name is the robot's name in
case files, its object is a function that takes the robot's options as keyword arguments and returns a
:class:`~screwsynth.models.model.Model`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from .hexapod import hexapod
from .model import Model
from .stewart_gough import stewart_gough
from .three_upu import three_upu

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class UnknownModelError(KeyError):
    """Error of a robot name that is unknown."""


class AmbiguousModelError(LookupError):
    """Error of a robot name that several packages define."""


RobotFunction = Callable[..., Model]

GROUP = "screwsynth.models"

SHIPPED: Mapping[str, RobotFunction] = MappingProxyType(
    {"stewart-gough": stewart_gough, "hexapod": hexapod, "three-upu": three_upu}
)


#: Folder of this package's robot files, one for each robot given joint by joint.
_GALLERY = Path(__file__).parent / "robots"


def model_names() -> tuple[str, ...]:
    """Return the names of all installed robots, those of this package first, without importing any robot."""
    shipped = (*SHIPPED, *gallery_names())
    return (*shipped, *sorted({offer.point.name for offer in _offers()} - set(shipped)))


def gallery_names() -> tuple[str, ...]:
    """Return the names of this package's robots that are given joint by joint, sorted."""
    return tuple(sorted(path.stem for path in _GALLERY.glob("*.toml")))


def gallery_description(name: str) -> str | None:
    """Return the description of a robot of the gallery without building it; None for an unknown name."""
    return gallery_tables(name)["description"] if name in gallery_names() else None


def gallery_tables(name: str) -> dict[str, Any]:
    """Return the tables of a gallery robot's file, by a name of :func:`gallery_names`."""
    import tomllib  # noqa: PLC0415 - most runs do not need it

    return tomllib.loads((_GALLERY / f"{name}.toml").read_text(encoding="utf-8"))


def definition_of(model: Model) -> dict[str, object]:
    """Return the tables of the robot file, with the robot's name, of a robot given joint by joint; empty if unknown."""
    found = model.options.get("definition")
    if isinstance(found, Mapping):
        return dict(found)
    in_gallery = model.structure and model.name in gallery_names()
    return gallery_tables(model.name) | {"name": model.name} if in_gallery else {}


@cache
def gallery_robot(name: str) -> Model:
    """Return a robot of this package that is given joint by joint.

    Args:
        name: one of :func:`gallery_names`.

    Raises:
        UnknownModelError: the name is unknown.
    """
    from .joints.model.robot import robot  # noqa: PLC0415 - most runs do not need it

    if name not in gallery_names():
        raise UnknownModelError(name)
    # Case files use the file's name of the robot, and people its own name.
    return replace(robot(**(gallery_tables(name) | {"name": name})), options={})


def robot_function(name: str) -> RobotFunction:
    """Return the function that builds a robot, by name; other packages cannot replace robots of this package.

    Args:
        name: the robot's name in case files.

    Raises:
        UnknownModelError: no robot has that name.
        AmbiguousModelError: several other packages have a robot of that name.
    """
    if name in SHIPPED:
        return SHIPPED[name]
    if name in gallery_names():

        def build() -> Model:
            return gallery_robot(name)

        return build
    offers = {offer.package: offer.point for offer in _offers() if offer.point.name == name}
    if not offers:
        raise UnknownModelError(name)
    if len(offers) > 1:
        raise AmbiguousModelError(
            f"the packages {' and '.join(sorted(offers))} offer this robot; uninstall all but one"
        )
    (point,) = offers.values()
    function: RobotFunction = point.load()
    return function


class _Offer(NamedTuple):
    """A robot of another package."""

    package: str
    point: EntryPoint


def _offers() -> list[_Offer]:
    """Return the robots of other packages; a package whose list of entry points cannot be read offers none."""
    from importlib.metadata import distributions  # noqa: PLC0415 - slow to import, and most runs do not need it

    offers: list[_Offer] = []
    seen: set[str] = set()
    for distribution in distributions():
        try:
            points = [point for point in distribution.entry_points if point.group == GROUP]
            package = distribution.name if points else ""  # slow to read
        except Exception:  # noqa: S112 - another package's files may be broken in any way
            continue
        if package not in seen:  # Python imports the first on the path
            offers += [_Offer(package or "a package without a name", point) for point in points]
            seen.update([package] if points else [])
    return offers
