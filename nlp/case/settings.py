"""Settings of the search of a case, and values that a regression expects of it."""

from __future__ import annotations

from ...models.values import dataclass
from ..errors import CaseError


@dataclass(frozen=True)
class Search:
    """Settings of the search.

    Attributes:
        starts: number of starting points.
        seed: seed of the random ones.
        max_iterations: the solver's limit for each start.
        compiled: whether Ipopt calls the objective as compiled C instead of through CasADi's interpreter. Compiled C
            needs a C compiler, and a second or two the first time.
        screen: whether a quick search in C finds the optima from the starts, which Ipopt then confirms, instead of
            Ipopt from each start. Where that search does not apply, Ipopt searches from each start.

    Raises:
        CaseError: a number is not whole, or too small.
    """

    starts: int = 32
    seed: int = 0
    max_iterations: int = 500
    compiled: bool = False
    screen: bool = True

    def __post_init__(self) -> None:
        for key, value, least in (
            ("starts", self.starts, 1),
            ("seed", self.seed, 0),
            ("max_iterations", self.max_iterations, 1),
        ):
            if isinstance(value, bool) or not hasattr(value, "__index__"):
                raise CaseError(f"solve.{key}", f"must be a whole number, got {value!r:.60}")
            if value < least:
                raise CaseError(f"solve.{key}", f"must be at least {least}", value)

    def but(self, starts: int | None, seed: int | None, *, compiled: bool = False) -> Search:
        """Return the same settings but for the ones that are given.

        Args:
            starts: number of starting points; None for the same.
            seed: seed; None for the same.
            compiled: whether the objective is compiled, also where these settings leave it interpreted.
        """
        return Search(
            self.starts if starts is None else starts,
            self.seed if seed is None else seed,
            self.max_iterations,
            self.compiled or compiled,
            self.screen,
        )


@dataclass(frozen=True)
class ExpectedValue:
    """A number that a regression expects in the result.

    Attributes:
        quantity: dotted path in the result, such as ``pose.angle``.
        value: the expected number, in the case's units.
        within: largest difference from it.
    """

    quantity: str
    value: float
    within: float


@dataclass(frozen=True)
class Expectation:
    """Values that a regression expects of a case.

    Attributes:
        F: objective at the optimum; None where nothing is expected of it.
        tolerance: largest difference of F, relative; absolute where F is 0.
        singular: whether J is rank deficient at the optimum; None where nothing is expected of it.
        values: other numbers of the result.
    """

    F: float | None = None
    tolerance: float = 1e-6
    singular: bool | None = None
    values: tuple[ExpectedValue, ...] = ()


@dataclass(frozen=True)
class Published:
    """A number that the literature prints, and whether this program reproduces it.

    Attributes:
        quantity: dotted path in the result, such as ``pose.angle``, or ``gain``: the percentage by which F exceeds that
            of the case ``over``.
        value: the number as printed.
        source: its place in the literature.
        reproduced: whether this program reproduces the number.
        because: the reason, where this program does not.
        decimals: number of digits printed behind the point, where the value alone does not show it.
        over: name of the case that a gain is over.
    """

    quantity: str
    value: tuple[float, ...]
    source: str
    reproduced: bool
    because: str = ""
    decimals: int | None = None
    over: str | None = None
