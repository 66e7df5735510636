"""The time of a certificate is shared by its solve and its proof."""

from typing import Any

import pytest

from screwsynth.nlp import certify, load_case
from screwsynth.nlp.interruption import seconds_left
from screwsynth.nlp.solver import certified
from screwsynth.nlp.solver.multistart import ProgramSolution, solve_program


@pytest.mark.parametrize("limit", [40.0, 3.0])
def test_a_solve_has_half_of_the_time_of_a_certificate_and_the_proof_has_the_rest(
    monkeypatch: pytest.MonkeyPatch, limit: float
) -> None:
    seen: list[float] = []

    def solve_and_look(*given: Any, **named: Any) -> ProgramSolution:  # noqa: ANN401 - those of the function
        seen.append(seconds_left())
        return solve_program(*given, **named)

    monkeypatch.setattr(certified, "solve_program", solve_and_look)
    found = certify(load_case("paper-4.1-helical"), time_limit=limit, jobs=1)
    assert seen == [pytest.approx(0.5 * limit)]
    assert found.certificates[0].boxes > 0
