"""How a case is searched, and what a regression expects of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import CaseError

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Search:
    """How the solver searches.

    Attributes:
        starts: number of starting points.
        seed: seed of the random ones.
        max_iterations: Ipopt's limit for each start.
        compiled: whether Ipopt calls the objective as compiled C instead of through CasADi's interpreter. It needs a C
            compiler, and a second or two the first time.
    """

    starts: int = 32
    seed: int = 0
    max_iterations: int = 500
    compiled: bool = False

    def __post_init__(self) -> None:
        for key, value, least in (
            ("starts", self.starts, 1),
            ("seed", self.seed, 0),
            ("max_iterations", self.max_iterations, 1),
        ):
            if value < least:
                raise CaseError(f"solve.{key}", f"must be at least {least}", value)

    def but(self, starts: int | None, seed: int | None, *, compiled: bool = False) -> Search:
        """The same search with another number of starts or seed where they are given, and compiled if asked."""
        return Search(
            self.starts if starts is None else starts,
            self.seed if seed is None else seed,
            self.max_iterations,
            self.compiled or compiled,
        )


@dataclass(frozen=True)
class ExpectedValue:
    """A number of the result, by its dotted path there, and how far it may be off."""

    quantity: str
    value: float
    within: float


@dataclass(frozen=True)
class Expectation:
    """What a regression holds the case to; ``tolerance`` is relative, and absolute where F is 0."""

    F: float | None = None
    tolerance: float = 1e-6
    singular: bool | None = None
    values: tuple[ExpectedValue, ...] = ()


@dataclass(frozen=True)
class Published:
    """A number that the literature prints, and whether this program reproduces it.

    Attributes:
        quantity: dotted path in the result, such as ``pose.angle``, or ``gain``: by how many percent F exceeds that of
            the case ``over``.
        value: as printed.
        source: where.
        reproduced: whether this program reproduces it.
        because: the reason, where it does not.
        decimals: digits printed behind the point, where the value alone does not show them.
        over: name of the case that a gain is over.
    """

    quantity: str
    value: tuple[float, ...]
    source: str
    reproduced: bool
    because: str = ""
    decimals: int | None = None
    over: str | None = None
