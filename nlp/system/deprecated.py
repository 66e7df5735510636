"""Arguments of public functions that have new names: the earlier ones work, with a ``DeprecationWarning``."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

Given = ParamSpec("Given")
Answer = TypeVar("Answer")


def renamed_argument(earlier: str, now: str) -> Callable[[Callable[Given, Answer]], Callable[Given, Answer]]:
    """Return a decorator with which a function also takes an argument by its earlier name.

    Args:
        earlier: earlier name of the argument.
        now: name of the argument.
    """

    def decorate(function: Callable[Given, Answer]) -> Callable[Given, Answer]:
        @wraps(function)
        def with_both(*args: Given.args, **given: Given.kwargs) -> Answer:
            if earlier not in given:
                return function(*args, **given)
            warn_deprecated(f"{function.__name__}({earlier}=...)", f"{now}=...")
            options: dict[str, Any] = {now if name == earlier else name: value for name, value in given.items()}
            return function(*args, **options)

        return with_both

    return decorate


def warn_deprecated(earlier: str, now: str) -> None:
    """Warn the caller of a public function that its form is deprecated, and name the new form.

    Args:
        earlier: deprecated form, as Python code.
        now: new form, as Python code.
    """
    warnings.warn(f"{earlier}: deprecated; use {now}", DeprecationWarning, stacklevel=3)
