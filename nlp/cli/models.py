"""The command ``models``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import options
from .commandline import Argument

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...models import Model
    from ..case.robots import ModelOption


def models(
    name: Annotated[str | None, Argument("[NAME]", "One robot, or a robot file (.toml), in full.")] = None,
    plot: options.PlotFile = None,
    whole: options.ShowAll = False,
) -> None:
    """List the robots, or show one in full.

    One robot is shown with its parameters, options and wrenches.
    """
    from ...models import model_names
    from ..case.robots import build_model, model_options
    from ..errors import InputError
    from ..results.robotwording import model_words, models_words

    options.Outputs(plot=plot).check({})
    if name is None:
        if plot is not None:
            raise InputError(f"--plot {plot}: needs the name of a robot")
        options.show(models_words((each, _description(each)) for each in model_names()), whole=whole)
        return
    if name.endswith(".toml"):
        _show_file(name, plot, whole=whole)
        return
    found = model_options(name)
    needed = [option.name for option in found if option.default is None]
    # Without the options that have no default, the robot cannot be built, and has no parameters to show.
    model = None if needed else build_model(name)
    if plot is not None:
        from ..output.pictures.plot import plot as draw

        if model is None:
            raise InputError(f"--plot {plot}: robot {name!r} needs its option {needed[0]!r} first")
        draw(_variants(name, model, found), plot)
    options.show(model_words(name, model, found), whole=whole)


def _show_file(file: str, plot: str | None, *, whole: bool) -> None:
    """Show the robot of a robot file in full, and draw it into a file."""
    from pathlib import Path

    from ..output.files import check_outputs
    from ..results.robotwording import model_words

    check_outputs({Path(file): "the robot file that is read"}, {"--plot": plot})
    model = options.read_robot(file)
    if plot is not None:
        from ..output.pictures.plot import plot as draw

        draw(model, plot)
    options.show(model_words(model.name, model, ()), whole=whole)


def _variants(name: str, model: Model, found: Sequence[ModelOption]) -> list[Model]:
    """Return the robot with each value of the first option whose values can be listed, or the robot alone."""
    from ..case.robots import build_model

    listed = next((option for option in found if option.choices), None)
    return [model] if listed is None else [build_model(name, {listed.name: value}) for value in listed.choices]


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
