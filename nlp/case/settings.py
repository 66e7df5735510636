"""Settings of a case's search, expected results for regression tests, and published values."""

from __future__ import annotations

from ...models.values import dataclass
from ..errors import CaseError


@dataclass(frozen=True)
class Search:
    """Settings of the search for optima.

    Attributes:
        starts: number of starting points.
        seed: seed of the random starting points.
        max_iterations: largest number of Ipopt iterations from each starting point.
        compiled: If true, Ipopt evaluates the objective as compiled C instead of by CasADi's interpreter. This needs a
            C compiler, and a second or two the first time.
        screen: If true, a fast search in C runs from all starting points, and Ipopt only confirms its optima. If
            false, or where the fast search does not apply, Ipopt runs from each starting point.

    Raises:
        CaseError: a setting is not a whole number, or too small.
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
        """Return a copy with some settings changed.

        Args:
            starts: number of starting points; None leaves it unchanged.
            seed: seed of the random starting points; None leaves it unchanged.
            compiled: If true, the objective is compiled; if false, this setting stays unchanged.
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
    """Expected value of a quantity in the result, for regression tests.

    Attributes:
        quantity: dotted path in the JSON result, such as ``pose.angle``.
        value: expected value, in the case's units.
        within: largest allowed difference, in the same unit.
    """

    quantity: str
    value: float
    within: float


@dataclass(frozen=True)
class Expectation:
    """Expected results of a case, for regression tests.

    Attributes:
        F: expected objective at the optimum; None for no expectation.
        tolerance: largest allowed difference of F, relative; absolute if F is 0.
        singular: If true, J must be rank deficient at the optimum; if false, regular; None for no expectation.
        values: expected values of other quantities of the result.
    """

    F: float | None = None
    tolerance: float = 1e-6
    singular: bool | None = None
    values: tuple[ExpectedValue, ...] = ()


@dataclass(frozen=True)
class Published:
    """Value printed in the literature, and whether screwsynth reproduces this value.

    Attributes:
        quantity: dotted path in the JSON result, such as ``pose.angle``, or ``gain``: percentage by which F exceeds
            the F of another case.
        value: value as printed, one number or several.
        source: place in the literature.
        reproduced: If true, this program reproduces the value.
        because: reason why the value is not reproduced; empty if it is.
        decimals: number of printed decimals, if trailing zeros were printed; None to count the decimals of the value.
        over: name of the reference case of a gain.
    """

    quantity: str
    value: tuple[float, ...]
    source: str
    reproduced: bool
    because: str = ""
    decimals: int | None = None
    over: str | None = None
