"""One table for sweeps, trade-offs, fronts and comparisons: its outputs, its proofs, and runs that are taken up."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builders import TWO_GOALS, Run, edited, output_of, refusal_of, rows_of, saved, unbroken

import screwsynth.nlp as sn
from screwsynth.nlp.solver import multistart
from screwsynth.nlp.solver.kept import kept_in
from screwsynth.nlp.solver.searchjournal import KeptCertificate, KeptSearch, SearchJournal

#: The first task of the case alone: F is that of legs of one length and of one horizontal distance of their ends.
UP = TWO_GOALS.replace('    { name = "side", sense = "max", axis = [1, 0, 0], pitch = inf },\n', "")
LONGEST = "limits.leg_length.max"
OVER = ("--over", f"{LONGEST}=12,20")
GOALS = ("--goal", "max F:up", "--goal", "max F:side", "--points", "4")


@pytest.fixture
def up(tmp_path: Path) -> str:
    return str(saved(tmp_path / "up.toml", UP))


@pytest.fixture
def two(tmp_path: Path) -> str:
    return str(saved(tmp_path / "two.toml", TWO_GOALS))


def without_times(data: object) -> object:
    if isinstance(data, dict):
        timed = ("seconds", "times", "history")
        return {key: without_times(value) for key, value in data.items() if key not in timed}
    return [without_times(each) for each in data] if isinstance(data, list) else data


def test_a_trade_off_with_proofs(up: str, cli: Run) -> None:
    rows = rows_of(output_of(cli("tradeoff", up, *OVER, "--certify", "--csv", "-")))
    assert [row["certificate"] for row in rows] == ["proved", "proved"]
    bounds, F, longest = ([float(row[name]) for row in rows] for name in ("proven_bound", "F", LONGEST))
    # F = 6 (1 - d^2 / l^2) for legs of the largest length l: the distance d is that of both values.
    assert (6 - F[0]) * longest[0] ** 2 == pytest.approx((6 - F[1]) * longest[1] ** 2, rel=1e-9)
    for row, bound, value in zip(rows, bounds, F, strict=True):
        assert value <= bound <= value * (1 + 1e-4)
        assert float(row["gap"]) == pytest.approx(bound - value, abs=1e-12)
        # The proof is that of certify at this value.
        found = sn.certify(sn.load_case(up, {LONGEST: float(row[LONGEST])}))
        assert bound == pytest.approx(found.tasks[0].bound, rel=1e-9)
    assert "certificate" not in rows_of(output_of(cli("tradeoff", up, *OVER, "--csv", "-")))[0]


def test_a_worse_optimum_than_that_of_the_box_is_replaced(up: str) -> None:
    found = sn.tradeoff(sn.load_case(up), {LONGEST: [12, 20]}, certified=True)
    for point in found.points:
        assert point.certified is not None
        assert point.certified.solution is point.solution
        assert point.certified.is_proved


COMMANDS = [
    ("tradeoff", "UP", *OVER, "--certify"),
    ("tradeoff", "TWO", *OVER, "--set", "x4=15"),
    ("pareto", "TWO", *GOALS, "--certify"),
    ("compare", "UP", "case", "6-sps", "--starts", "1", "--certify"),
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: " ".join(words[:2]))
def test_a_stopped_run_is_taken_up(
    command: tuple[str, ...], up: str, two: str, tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = [{"UP": up, "TWO": two}.get(word, word) for word in command]
    journal, files = tmp_path / "journal", [tmp_path / "one.json", tmp_path / "other.json"]
    searches: list[int] = []
    solved: Callable[..., Any] = multistart._solved
    monkeypatch.setattr(multistart, "_solved", lambda *given: searches.append(1) or solved(*given))
    output_of(cli(*words, "--json", str(files[0])))
    whole = len(searches)
    add = SearchJournal.add

    def add_twice(self: SearchJournal, entry: KeptSearch | KeptCertificate) -> None:
        add(self, entry)
        if len(self) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(SearchJournal, "add", add_twice)
    searches.clear()
    assert cli(*words, "--json", str(files[1]), "--resume", str(journal))[0] == 130
    monkeypatch.setattr(SearchJournal, "add", add)
    assert journal.exists()
    assert not files[1].exists()
    begun = len(searches)
    searches.clear()
    code, _, said = cli(*words, "--json", str(files[1]), "--resume", str(journal))
    assert code == 0
    assert f"2 searches are in {journal} already" in said
    assert len(searches) == whole - begun
    assert not journal.exists()
    one, other = (without_times(json.loads(file.read_text())) for file in files)
    assert one == other


def test_a_certificate_that_its_share_of_the_time_cuts_short_is_tried_again(tmp_path: Path) -> None:
    # Two tasks and their worst case share the time.
    ends = ("x1 = 12, x2 = 4, x3 = 30", "x1 = { min = 8, max = 12 }, x2 = { min = 3, max = 5 }, x3 = 30")
    case = sn.load_case(saved(tmp_path / "two.toml", edited(TWO_GOALS, ends) + '[combine]\nmethod = "worst-case"\n'))
    with SearchJournal(tmp_path / "journal") as journal, kept_in(journal):
        found = sn.certify(case, time_limit=0.1)
        statuses = [each.status.value for each in found.certificates]
        assert "incomplete" in statuses
        searches = 3
        assert len(journal) == searches + len(statuses) - statuses.count("incomplete")
        found = sn.certify(case)
        assert found.is_proved
        assert len(journal) == searches + len(statuses)
        again = sn.certify(case)
        assert [each.seconds for each in again.certificates] == [each.seconds for each in found.certificates]


def test_limits_that_differ_by_little_in_a_small_unit_are_searched_each(tmp_path: Path) -> None:
    scaled = (("x1 = 12, x2 = 4", "x1 = 120000, x2 = 40000"), ("min = 5, max = 40", "min = 50000, max = 400000"))
    case = saved(tmp_path / "up.toml", edited(UP, ('"cm"', '"um"'), *scaled, ("min = 2, max = 60", "max = 600000")))
    lost = []
    with SearchJournal(tmp_path / "journal") as journal, kept_in(journal):
        for longest in (160000.0, 160010.0):
            found = sn.solve(sn.load_case(case, {LONGEST: longest}))
            # F = 6 (1 - d^2 / l^2), as above.
            lost.append((6 - found.F) * longest**2)
        assert len(journal) == 2
    assert lost[0] == pytest.approx(lost[1], rel=1e-9)


def test_journals_of_others_are_left_as_they_are(up: str, tmp_path: Path, cli: Run) -> None:
    journal = saved(tmp_path / "journal", "mine\n")
    words = "belongs to another command; choose another --resume, or remove it"
    refusal_of(cli("tradeoff", up, *OVER, "--resume", str(journal)), words)
    assert journal.read_text() == "mine\n"
    journal.unlink()
    with SearchJournal(journal):
        refusal_of(cli("tradeoff", up, *OVER, "--resume", str(journal)), "another run of this command is writing it")
    assert not journal.exists()  # it had no entry
    # An entry that is none of its program is searched anew.
    for text in ("[1]", "[]", '["","optimal","nan","","",[],true,[],[],[],0,0.0,""]'):
        head = json.dumps({"screwsynth": "searches", "version": sn.__version__})
        journal.write_text(f"{head}\n{text}\n")
        assert cli("tradeoff", up, *OVER, "--starts", "1", "--resume", str(journal))[0] == 0


def test_a_sweep_without_a_file_of_its_table(up: str, tmp_path: Path, cli: Run) -> None:
    words = ("sweep", up, "--over", "x1=12,13", "--starts", "1", "--jobs", "1", "--engine", "ipopt", "--certify")
    out = tmp_path / "out.csv"
    said = output_of(cli(*words, "--out", str(out)))
    table = rows_of(output_of(cli(*words, "--csv", "-")))
    rows = rows_of(out.read_text())
    assert [set(one) - set(other) for one, other in zip(rows, table, strict=True)] == [{"screwsynth_sweep"}] * 2
    for one, other in zip(rows, table, strict=True):
        assert {key: value for key, value in other.items() if key != "seconds"}.items() <= one.items()
        assert float(one["F"]) <= float(one["bound"]) <= float(one["F"]) * (1 + 1e-4)
    plain = output_of(cli(*words))
    assert "2 are proved" in unbroken(plain)
    assert "".join(said.split()) == f"{''.join(plain.split())}:{out}"
    assert not list(tmp_path.glob("*.journal"))
    # A journal of its own is removed at the end, as the one beside a table.
    journal = tmp_path / "mine"
    output_of(cli(*words, "--resume", str(journal)))
    assert not journal.exists()


@pytest.mark.parametrize("command", [("tradeoff", "UP", *OVER), ("pareto", "TWO", *GOALS)], ids=lambda words: words[0])
def test_markdown_has_the_table_of_the_terminal(command: tuple[str, ...], up: str, two: str, cli: Run) -> None:
    words = [{"UP": up, "TWO": two}.get(word, word) for word in command]
    lines = output_of(cli(*words, "--markdown", "-")).splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    rows = rows_of(output_of(cli(*words, "--csv", "-")))
    assert len(cells) == 2 + len(rows)
    assert [row[0] for row in cells[2:]] == [f"{float(next(iter(row.values()))):.7g}" for row in rows]
