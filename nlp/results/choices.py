"""Choice among listed values and rounding of dimensions, with the outcomes of these searches in words."""

from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.choices import ChosenDimension, catalogue_dimensions, chosen_settings
from ..solver.status import Status
from ..system.jsonvalues import JsonObject

if TYPE_CHECKING:
    from ..solver.solution import Choice, Rounding, Solution


#: Relative difference up to which a dimension counts as round already.
_SAME = 1e-9


class ChoiceData(JsonObject):
    """Choice among listed values.

    Attributes:
        numbers: dimensions with listed values.
        combinations: number of all combinations.
        solved: number of solved combinations.
        complete: If true, all combinations are solved, or excluded: no better design was found within their ranges.
        statement: outcome in words.
    """

    numbers: tuple[ChosenDimension, ...]
    combinations: int
    solved: int
    complete: bool
    statement: str


class RoundingData(JsonObject):
    """Rounding of the dimensions.

    Attributes:
        step: step of the multiples, in the unit of length, and degrees for angles.
        numbers: rounded dimensions.
        before: objective before the rounding.
        loss: loss of the objective by the rounding; null without an answer.
        relative_loss: loss divided by the objective before rounding; null without an answer, or if the divisor is 0.
        combinations: number of searched combinations of multiples.
        solved: number of solved combinations.
        complete: If true, all combinations are solved, or excluded: no better design was found within their ranges.
        statement: outcome in words.
    """

    step: float
    numbers: tuple[ChosenDimension, ...]
    before: float
    loss: float | None
    relative_loss: float | None
    combinations: int
    solved: int
    complete: bool
    statement: str


def choice_data(solution: "Solution") -> ChoiceData | None:
    """Return the choice among the listed values of a solution's case; None without listed values."""
    case, choice = solution.case, solution.choice
    if choice is None:
        return None
    chosen = chosen_settings(case, solution.chosen_case)
    numbers = tuple(
        ChosenDimension.of(
            each, case.units, value=chosen[each.name], unit=case.units.label(each.dimension), before=None
        )
        for each in catalogue_dimensions(case)
    )
    return ChoiceData.of(
        choice,
        numbers=numbers,
        complete=choice.is_complete,
        statement=_statement(choice, _starts(solution), solution.status),
    )


def _starts(solution: "Solution") -> int:
    """Return the number of starts of each solve; 0 for a case without other variables."""
    return len(solution.outcomes[0].own.starts)


def _statement(choice: "Choice", starts: int, status: Status) -> str:
    """Return the outcome of a search over combinations, in words."""
    is_answer = status.is_answer
    count = f"{choice.combinations:,} combinations of values"
    how = f"solved from {starts} starts" if starts else "solved"
    if choice.solved == choice.combinations:
        searched = f"{count}, each {how}"
        return f"the best of {searched}" if is_answer else f"none of {searched}, gave an answer"
    if not choice.is_complete:
        some = f"{choice.solved:,} of {count}, {how}"
        if status is Status.INTERRUPTED:
            if not choice.solved:
                return f"stopped in the first of {count}"
            return f"stopped after {some}; not all others are searched"
        return f"the best of {some}; not all others are searched" if is_answer else f"no answer in {some}"
    # The solves of ranges began from as many starts.
    ranges = f"{choice.solved:,} {how}, and the others excluded by solves of {choice.relaxed:,} ranges of values"
    return f"the best of {count}: {ranges}" if is_answer else f"no answer in {count}: {ranges}"


def rounding_data(solution: "Solution") -> RoundingData | None:
    """Return the rounding of a solution's dimensions; None if they are not rounded."""
    case, rounding = solution.case, solution.rounding
    if rounding is None:
        return None
    is_answer = solution.status.is_answer
    decided = solution.decided_by
    sign = 1.0 if decided is None else decided.nlp.sign
    before = sign * rounding.before
    loss = rounding.after - rounding.before if is_answer else None
    choice = rounding.choice
    return RoundingData(
        step=rounding.step,
        numbers=ChosenDimension.of_each(rounding.numbers, case.units),
        before=before,
        loss=loss,
        relative_loss=None if loss is None or not before else loss / abs(before),
        combinations=1 if choice is None else choice.combinations,
        solved=1 if choice is None else choice.solved,
        complete=choice is None or choice.is_complete,
        statement=_rounding_statement(solution, rounding),
    )


def _rounding_statement(solution: "Solution", rounding: "Rounding") -> str:
    """Return the outcome of rounding, in words."""
    case, starts, status = solution.case, _starts(solution), solution.status
    kinds = {each.dimension for each in rounding.numbers}
    names = [f"{rounding.step:g} {case.units.length}"] if Dimension.LENGTH in kinds else []
    names += [f"{rounding.step:g} deg"] if Dimension.ANGLE in kinds else []
    what = f"to multiples of {' and '.join(names)}"
    if status is Status.INTERRUPTED:
        stopped = "" if rounding.choice is None else _statement(rounding.choice, starts, status)
        return f"{what}: {stopped or 'stopped before the end'}"
    if not status.is_answer:
        return f"{what}: no multiples within {rounding.farther + 1} steps were found that satisfy all limits"
    if all(abs(each.value - (each.before or 0.0)) <= _SAME * abs(each.value) for each in rounding.numbers):
        return f"{what}: the dimensions were round already"
    if rounding.choice is None:
        return f"{what}: every dimension has only one multiple within its bounds"
    return f"{what}: {_statement(rounding.choice, starts, status)}"
