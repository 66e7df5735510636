"""Command ``models``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import contents, options
from .commandline import Argument

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...models import Model
    from ..case.robots import ModelOption


def models(
    name: Annotated[
        str | None, Argument("[NAME]", "Name of a robot, or a robot file (.toml), to show in full.")
    ] = None,
    plot: options.PlotFile = None,
    whole: options.ShowAll = False,
) -> None:
    """List the robots, or show one in full.

    A robot is shown with its options, parameters, limbs and wrenches.
    """
    from pathlib import Path

    from ...models import model_names
    from ..case.robots import build_model, model_options
    from ..errors import InputError
    from ..words.models import model_words, models_words

    file = name if name is not None and name.endswith(".toml") else None
    files = options.Outputs(plot=plot)
    files.check({} if file is None else {Path(file): "the robot file that is read"})
    if name is None:
        if plot is not None:
            raise InputError(f"--plot {plot}: needs the name of a robot")
        options.show(models_words((each, _description(each)) for each in model_names()), whole=whole)
        return
    found = model_options(name) if file is None else ()
    needed = [option.name for option in found if option.default is None]
    # A robot whose options have no default cannot be built, and has no parameters to show.
    model = options.read_robot(file) if file is not None else None if needed else build_model(name)
    if plot is not None and model is None:
        raise InputError(
            f"--plot {plot}: robot {name!r} cannot be drawn without its option {needed[0]!r}; plot a case instead"
        )
    files.deliver(
        lambda: model_words(name if file is None or model is None else model.name, model, found),
        whole=whole,
        plot=lambda: contents.figure_of([contents.drawing_of_model(each) for each in _variants(name, model, found)]),
    )


def _variants(name: str, model: Model | None, found: Sequence[ModelOption]) -> list[Model]:
    """Return the robot with each value of the first option with listed values; without such an option, the robot."""
    from ..case.robots import build_model

    listed = next((option for option in found if option.choices), None)
    if listed is None:
        return [] if model is None else [model]
    return [build_model(name, {listed.name: value}) for value in listed.choices]


def _description(model: str) -> str:
    """Return a robot's description, or the fault of a robot that cannot be built.

    The fault of one package's robot must not hide the other robots.
    """
    from ...models.catalog import gallery_description
    from ..case.robots import build_model
    from ..errors import CaseError

    try:
        return gallery_description(model) or build_model(model).description
    except CaseError as error:
        return error.fault
