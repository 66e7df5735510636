"""Sweeps: every row is an answer with evidence, and a killed run loses and doubles nothing."""

import itertools
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, output_of, refusal_of, rows_of, saved, starter_tables
from generated import needs_compiler
from matplotlib.backends.backend_agg import FigureCanvasAgg

from screwsynth.nlp import InputError, examine, formulate, load_case, load_result, solve
from screwsynth.nlp import sweep as run_in_python
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.evidence.many import Numbers, _scales, judge_many
from screwsynth.nlp.output.pictures.designs import designs_figure, legend_of
from screwsynth.nlp.output.sweeptable import table_rows, write_table
from screwsynth.nlp.results.explorations import SweepResult
from screwsynth.nlp.sweeps import workers
from screwsynth.nlp.sweeps.columns import sweep_designs
from screwsynth.nlp.sweeps.engines import EngineKind, Job
from screwsynth.nlp.sweeps.journal import Journal, Row
from screwsynth.nlp.sweeps.points import CaseSource, Points, grid, points_of_csv
from screwsynth.nlp.sweeps.sweep import Sweep, run_sweep
from screwsynth.nlp.sweeps.workers import PointBlock, answer_in_processes
from screwsynth.nlp.system.journal import line_of, row_of
from screwsynth.nlp.words.designs import Designs

CASE = "paper-4.1-helical"
#: Case files that say the same number in two ways are the same to this part.
SAME = 1e-9
OVER = ("--over", "task.pitch=0.2:2:4", "--over", "x1=10,12.5,14")


def answers(path: Path) -> list[dict[str, str]]:
    """All columns of a table's rows but the time that each took."""
    rows = rows_of(path.read_text(encoding="utf-8"))
    return [{name: cell for name, cell in row.items() if name != "seconds"} for row in rows]


@pytest.fixture
def sweep() -> Callable[..., Sweep]:
    def of(*over: str, starts: int = 2) -> Sweep:
        return Sweep.of(CaseSource.from_file(read_case(CASE)), grid(over), starts)

    return of


def test_many_verdicts_are_those_of_single_points() -> None:
    values = ((0.2, 10), (1.0, 12), (2.0, 14), (1.5, 10))
    at = [load_case(CASE, {"task.pitch": pitch, "x1": x1}) for pitch, x1 in values]
    nlps = [formulate(case) for case in at]
    optima = [solve(case, starts=1).x for case in at]
    middle = [nlp.centre + 0.1 * nlp.scale for nlp in nlps]
    outside = [x + 3 * nlp.scale for x, nlp in zip(optima, nlps, strict=True)]
    x, several = np.array([*optima, *middle, *outside]), nlps * 3
    names = ("arguments", "lower", "upper", "g_lower", "g_upper")
    numbers = Numbers(*(np.array([getattr(nlp, name) for nlp in several]) for name in names))
    # Where ranges are narrow, changes between the bounds are the scale of F.
    narrow = [replace(each, lower=each.centre, upper=each.centre + 1e-5 * each.scale) for each in nlps]
    ends = {name: np.array([getattr(each, name) for each in narrow]) for name in ("lower", "upper")}
    scales = _scales(narrow[0], numbers.at(np.arange(4))._replace(**ends))
    assert scales.objective == pytest.approx([each.objective_scale for each in narrow], rel=1e-9)
    # The program is that of another case: the numbers alone tell the points apart.
    found = judge_many(formulate(load_case(CASE)), x, numbers)
    single = [examine(nlp, point) for nlp, point in zip(several, x, strict=True)]
    assert found.is_strict.tolist() == [each.kind.is_optimum for each in single] == [True] * 4 + [False] * 8
    assert found.feasibility == pytest.approx([each.feasibility for each in single], abs=1e-14)
    for k, (nlp, evidence) in enumerate(zip(several, single, strict=True)):
        sides = np.flatnonzero(found.active[k])
        assert [nlp.sides.sides[j].name for j in sides] == [side.name for side in evidence.active]
        if k < 4:
            assert found.F[k] == pytest.approx(nlp.evaluate(x[k]).F, rel=1e-14)
            assert found.stationarity[k] == pytest.approx(evidence.stationarity, abs=1e-12)
            assert found.curvature[k] == pytest.approx(evidence.eigenvalues[0], rel=1e-6)
            bounds = [j for j in sides if nlp.sides.sides[j].variable is not None]
            mine = [found.multipliers[k, j] * found.weights[k, j] for j in bounds]
            theirs = [side.multiplier for side in evidence.active][: len(bounds)]
            assert mine == pytest.approx(theirs, rel=1e-6)


@needs_compiler
def test_compiled_rows_are_those_of_solve(tmp_path: Path, cli: Run) -> None:
    out, picture = tmp_path / "sweep.csv", tmp_path / "sweep.svg"
    command = ("sweep", CASE, *OVER, "--out", str(out))
    code, said, _ = cli(*command, "--engine", "compiled", "--plot", str(picture))
    rows = rows_of(out.read_text(encoding="utf-8"))
    assert (code, len(rows), [row["index"] for row in rows]) == (0, 12, [str(k) for k in range(12)])
    assert said.startswith("12 of 12 points have an optimum")
    assert {row["engine"] for row in rows} == {"compiled"}
    assert not list(tmp_path.glob("*.journal"))
    assert b"region" in picture.read_bytes()
    for k in (0, 7, 11):
        row = rows[k]
        one = solve(load_case(CASE, {name: float(row[name]) for name in ("task.pitch", "x1")}), starts=8)
        assert float(row["F"]) == pytest.approx(one.F, rel=SAME)
        assert row["active"] == "; ".join(f"{side.name} {side.bound}" for side in one.evidence.active)
        multipliers = [side.multiplier for side in one.evidence.active]
        assert [float(each) for each in row["multipliers"].split("; ")] == pytest.approx(multipliers, rel=1e-5)
    before = out.read_bytes()
    code, _, err = cli(*command)
    assert (code, out.read_bytes()) == (0, before)
    assert "already has all 12 points" in err
    err = refusal_of(cli("sweep", CASE, *OVER, "--starts", "3", "--out", str(out)))
    assert out.read_bytes() == before
    sentence = "exists and is not the table of this sweep; choose another name, or remove it"
    assert err == f"screwsynth: --out {out}: {sentence}\n"


def test_points_of_a_file_and_parquet(tmp_path: Path, cli: Run) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "sweep.parquet"
    # The limit on the rotation is a bound of the program; the axis of the last point is none.
    rows = "2,2,1,10\n0,0,1,9\n1,0,0,5\n0,0,0,7\n0,1,1,8\n"
    points = saved(tmp_path / "points.csv", f"task.axis_x,task.axis_y,task.axis_z,p_x.max\n{rows}")
    words = ("--over", str(points), "--starts", "2", "--engine", "ipopt", "--jobs", "1", "--out", str(out))
    said = output_of(cli("sweep", CASE, *words))
    found = pq.read_table(out).to_pydict()
    assert found["index"] == list(range(5))
    assert found["status"] == ["optimal", "optimal", "optimal", "refused", "optimal"]
    assert "task[0].axis" in found["note"][3]
    assert found["F"][3] is None
    assert said.startswith("4 of 5 points have an optimum")
    source = CaseSource.from_file(read_case(CASE))
    one = Sweep.of(source, points_of_csv(points.read_text(), str(points)), starts=2)
    assert ["; ".join(row.active) for row in table_rows(str(out), one)] == found["active"]


def test_a_sweep_in_python_is_that_of_the_command(tmp_path: Path, cli: Run) -> None:
    out, files = tmp_path / "sweep.csv", {name: tmp_path / f"out.{name}" for name in ("json", "html")}
    options = [word for name, file in files.items() for word in (f"--{name}", str(file))]
    over = ("--over", "task.pitch=0.2,1", "--over", "x1=10,12", "--starts", "2", "--engine", "ipopt", "--jobs", "1")
    code, said, err = cli("sweep", CASE, *over, "--out", str(out), *options)
    assert (code, err, said[:33]) == (0, "", "4 of 4 points have an optimum, F "), err
    values = {"task.pitch": (0.2, 1), "x1": (10, 12)}
    columns = run_in_python(load_case(CASE), values, starts=2, engine="ipopt", jobs=1)
    rows = rows_of(out.read_text(encoding="utf-8"))
    assert columns.F.tolist() == [float(row["F"]) for row in rows]
    assert columns.design["p_z"].tolist() == [float(row["p_z"]) for row in rows]
    assert columns.numbers["x1"].tolist() == [10, 12, 10, 12]
    assert [";".join(each) for each in columns.active] == [row["active"].replace("; ", ";") for row in rows]
    result = load_result(files["json"])
    assert isinstance(result, SweepResult)
    assert tuple(columns.F.tolist()) == result.F
    assert files["html"].read_text().count("<tr>") == 5


def test_rows_with_certificates_are_taken_up(tmp_path: Path) -> None:
    case = load_case(CASE, {"p_x.max": 1, "p_x.min": -1, "p_y.min": -1, "p_y.max": 1, "p_z.min": 39})
    file = tmp_path / "sweep.csv"
    values = {"task.pitch": (0.2, 1.0, 2.0)}

    def stop(_before: int, done: int, _total: int, _seconds: float) -> None:
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_in_python(case, values, out=file, starts=2, jobs=1, certified=True, time_limit=20, progress=stop)
    kept = [row_of(Row, line) for line in file.with_name("sweep.csv.journal").read_text().splitlines()[1:]]
    assert [row.point for row in kept] == [0]
    found = run_in_python(case, values, out=file, starts=2, jobs=1, certified=True, time_limit=20)
    # The first row, its time too, is that of the first run.
    assert (found.seconds[0], found.gap[0]) == (kept[0].seconds, kept[0].gap)
    assert found.certificate == ("proved",) * 3
    assert (found.bound >= found.F * (1 - 1e-9)).all()
    assert found.gap == pytest.approx(found.bound - found.F, abs=1e-9)
    assert not file.with_name("sweep.csv.journal").exists()
    again = run_in_python(case, values, out=file, starts=2, certified=True, time_limit=20)
    assert again.seconds.tolist() == found.seconds.tolist()
    with pytest.raises(InputError, match="is not the table of this sweep"):
        run_in_python(case, values, out=file, starts=2)


def test_joints_are_no_design() -> None:
    case = case_from(starter_tables("3-rps"), "mine")
    found = run_in_python(case, {"task.pitch": (2,)}, starts=1)
    assert [name for name in found.design if name.startswith("q") and name[1:2].isdigit()] == []
    assert set(found.design) == {"rb", "p_x", "p_y", "p_z", "q_x", "q_y", "q_z"}
    for arguments, words in (
        ({}, "a sweep needs exactly one of over and points"),
        ({"over": {"rb": (1, 1)}}, "contains a value twice"),
        ({"over": {"rb": (1, "a")}}, "rb = a: must be a finite number"),
        ({"over": {"rb": ()}}, "rb: has no values"),
        ({"points": {"rb": (1, 2), "rp": (1,)}}, "got rb 2, rp 1"),
        ({"over": {"rb": (1, 2)}, "engine": "fast"}, "must be compiled or ipopt"),
        ({"over": {"rp": (1, 0.9)}, "engine": "compiled", "certified": True}, "conflicts with --certify"),
        ({"over": {"rb": (1, 2)}, "time_limit": 0}, "must be positive"),
    ):
        with pytest.raises(InputError, match=words):
            run_in_python(case, **arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--over", "x9=1:2:3"), "x9: cannot be set; allowed: x1, x2,"),
        (("--over", "task.pich=1:2:3"), "did you mean 'task.pitch'?"),
        (("--over", "x1=1:2:0"), "COUNT = 0 must be a whole number from 1 to"),
        (("--over", "x1=1:2"), "must be NAME=FIRST:LAST:COUNT or NAME=V1,V2,..."),
        (("--over", "x1=1,nan"), "value = 'nan': must be a finite number"),
        (("--over", "x1=1,1"), "contains a value twice"),
        (("--over", "x1=-4:2:3"), "robot.parameters.x1 = -4.0: must be at least 0"),
        (("--over", "x1=1:2:9999", "--over", "x2=1:2:9999"), "at most 10,000,000 are allowed"),
        (("--over", "x1=1,2", "--over", "x1=3,4"), "x1 is given twice"),
        (("--over", "EMPTY"), "has 0 points"),
        (("--over", "SHORT"), "row 3: must have 2 cells, got 1"),
        (("--over", "WORDS"), 'row 4, column x2 = "1,1": must be a number; write 1.1'),
        (("--over", "x1=1,2", "--over", "EMPTY"), "a file of points cannot be combined with ranges or lists"),
        ((), "--over: is missing: NAME=FIRST:LAST:COUNT, parameter to vary"),
        (("--over", "x1=1,2", "--engine", "fast"), "--engine fast: must be compiled or ipopt"),
        (("--over", "x1=10,12", "--starts", "17", "--engine", "compiled"), "at most 16 starting points, but 17 are"),
        (("--over", "x1=1,2", "--over", "x2=1,2", "--over", "x3=1,2", "--plot", "p.png"), "got a grid over 3 names"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence(arguments: tuple[str, ...], words: str, tmp_path: Path, cli: Run) -> None:
    files = {"EMPTY": saved(tmp_path / "empty.csv", "x1,x2\n")}
    files["SHORT"] = saved(tmp_path / "short.csv", "x1,x2\n10,11\n12\n")
    files["WORDS"] = saved(tmp_path / "words.csv", "x1;x2\n10;11\n\n12;1,1\n")
    out = tmp_path / "out.csv"
    given = [str(files.get(word, word)) for word in arguments]
    refusal_of(cli("sweep", CASE, *given, "--out", str(out)), words)
    assert not out.exists()
    assert not list(tmp_path.glob("*.journal"))


def test_other_outputs_are_refused(tmp_path: Path, cli: Run) -> None:
    out = tmp_path / "out.csv"
    for name, words in (("out.txt", "must end in .parquet or .csv"), ("no/x.csv", "is not a folder")):
        refusal_of(cli("sweep", CASE, *OVER, "--out", str(tmp_path / name)), words)
    journal = Path(f"{out}.journal")
    for path, words in ((out, "is not the table of this sweep"), (journal, "belongs to another sweep")):
        path.write_text("mine\n")
        refusal_of(cli("sweep", CASE, *OVER, "--out", str(out)), words)
        assert path.read_text() == "mine\n"
        path.unlink()


def test_a_journal_cut_off_anywhere_keeps_whole_rows(tmp_path: Path) -> None:
    path, rows = tmp_path / "journal", [Row(k, "optimal", k / 3, x=(k / 7,), active=("ä max",)) for k in (2, 0, 3, 1)]
    whole = Journal(path, "abc", 4)
    whole.add(rows[:2])
    whole.add([*rows, rows[0]])
    with pytest.raises(InputError, match="another run of this sweep is writing it"):
        Journal(path, "abc", 4)
    assert list(whole.rows()) == sorted(rows)
    whole.close()
    content = path.read_bytes()
    head = len(content) - sum(len(line_of(row).encode()) for row in rows)
    for length in range(len(content)):
        path.write_bytes(content[:length])
        journal = Journal(path, "abc", 4)
        kept = 4 - len(journal.missing)
        assert kept == content[head:length].count(b"\n") if length >= head else kept == 0
        journal.add(rows)
        assert (len(journal.missing), list(journal.rows())) == (0, sorted(rows))
        journal.close()
        assert path.read_bytes() == content
    with pytest.raises(InputError, match="belongs to another sweep"):
        Journal(path, "abd", 4)


def test_ipopt_without_a_compiler(sweep: Callable[..., Sweep], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", str(tmp_path / "no-compiler"))
    monkeypatch.setenv("PATH", "")
    one, said = sweep("x1=11.5,11.75", starts=1), list[str]()
    journal = one.journal_of(str(tmp_path / "out.csv"))
    run_sweep(one, journal, jobs=1, notice=said.append)
    rows = list(journal.rows())
    journal.close()
    assert [row.engine for row in rows] == ["ipopt", "ipopt"]
    assert "the environment variable CC names" in said[0]
    alone = solve(load_case(CASE, {"x1": 11.75}), starts=1)
    assert pytest.approx(alone.F, rel=1e-12) == rows[1].F


def test_a_row_group_is_in_memory_at_once(sweep: Callable[..., Sweep], tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    one = sweep("x1=10:14:45000")
    asked = 0

    def rows() -> Iterator[Row]:
        nonlocal asked
        for k in range(45_000):
            asked = k
            yield Row(k, "optimal", float(k), x=(0.0,) * 6)

    write_table(str(tmp_path / "out.parquet"), one, rows())
    file = pq.ParquetFile(tmp_path / "out.parquet")
    assert [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)] == [20_000, 20_000, 5_000]
    assert asked == 44_999
    assert file.read(columns=["x1"]).to_pydict()["x1"] == one.points.values[:, 0].tolist()


def designs_on(points: Points, F: Sequence[float], active: Iterable[tuple[str, ...]]) -> Designs[Row]:
    """The table of a sweep with made-up answers."""
    source = CaseSource.from_file(read_case("hexapod-machining"))
    values = [None if math.isnan(value) else value for value in F]
    rows = [Row(k, "optimal", value, active=each) for k, (value, each) in enumerate(zip(values, active, strict=True))]
    return sweep_designs(Sweep.of(source, points), rows)


def test_axes_of_a_sweep_have_units() -> None:
    found = designs_on(grid(["limits.leg_length.max=32,34", "task.pitch=0.1,0.2"]), [1.0] * 4, [()] * 4)
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in designs_figure(found).axes]
    assert labels[0] == ("maximum leg length, in", "task pitch, in/rad")
    found = designs_on(grid(["x3=1,2", "x1=30,31"]), [1.0] * 4, [()] * 4)
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in designs_figure(found).axes]
    assert labels[0] == ("x3, deg", "x1, in")


def test_regions_of_a_sweep_have_numbers_that_a_legend_explains() -> None:
    points = grid(["x1=26:32:13", "x2=10:13:7"])
    x1, x2 = (each.ravel() for each in np.meshgrid(*points.axes, indexing="ij"))
    # Three regions: a half, a quarter, and a quarter without an answer.
    sides = [("leg_length limb 1- max", "leg_length limb 1+ max", "x3 min") if a < 29 else ("x3 min",) for a in x1]
    found = designs_on(points, np.where((x1 >= 29) & (x2 > 11.5), math.nan, x1 + x2).tolist(), sides)
    figure = designs_figure(found)
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    numbers = {text.get_text(): text.get_position() for text in axes.texts if text.get_gid() == "number"}
    lines = {line.partition(": ")[0]: line.partition(": ")[2] for line in legend_of(found)}
    assert lines.pop("Lines").endswith("Empty: no optimum.")
    limits = {"1": "also leg_length max (limb 1-, limb 1+)", "2": "no other active limit"}
    assert lines == {"Active in all regions": "x3 min", **limits}
    assert set(numbers) == {"1", "2"}
    assert numbers["1"][0] < 28.75 < numbers["2"][0]
    assert numbers["2"][1] < 11.75
    for axis, values in zip((axes.get_xticks(), axes.get_yticks()), points.axes, strict=True):
        assert 5 <= len(axis) <= 9
        assert set(axis) <= set(values)
    drawn = figure.get_supxlabel()
    assert all(line in drawn for line in legend_of(found))
    # The legend stands below the axes, and within the picture.
    (legend,) = [text for text in figure.texts if text.get_text() == drawn]
    box = legend.get_window_extent()
    assert min(box.x0, box.y0) >= 0
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= axes.xaxis.label.get_window_extent().y0


def test_numbers_above_a_curve_do_not_cover_each_other() -> None:
    sides = [("x2 min",) if k % 8 < 2 else ("x3 min",) if k % 8 < 4 else () for k in range(25)]
    figure = designs_figure(designs_on(grid(["x1=26:32:25"]), list(map(float, range(25))), sides))
    FigureCanvasAgg(figure).draw()
    boxes = [text.get_bbox_patch().get_window_extent() for text in figure.axes[0].texts]
    assert len(boxes) == 10  # one for each run of equal limits
    assert not [1 for one, other in itertools.combinations(boxes, 2) if one.overlaps(other)]


#: A command that is killed in the middle of a row, in the block of rows whose number comes first.
KILLED = """
import os, signal, sys
from screwsynth.nlp.cli.main import main
from screwsynth.nlp.sweeps import sweep
from screwsynth.nlp.sweeps.journal import Journal
from screwsynth.nlp.system.journal import line_of

sweep._BLOCK = 128
append, left = Journal.add, [int(sys.argv.pop(1))]
def append_or_die(journal, rows):
    left[0] -= 1
    rows = list(rows)
    append(journal, rows if left[0] else rows[::2])
    if not left[0]:
        journal._file.write(line_of(rows[1]).encode()[:20])
        journal._file.flush()
        os.kill(os.getpid(), signal.SIGKILL)
Journal.add = append_or_die
main()
"""


@needs_compiler
@pytest.mark.slow
def test_a_run_killed_three_times_has_the_same_table(tmp_path: Path, cli: Run) -> None:
    over = ("--over", "task.pitch=0:2:12", "--over", "x1=10:14:25", "--starts", "4")
    whole, parts = tmp_path / "whole.csv", tmp_path / "parts.csv"
    assert cli("sweep", CASE, *over, "--out", str(whole))[0] == 0
    journal, sizes = Path(f"{parts}.journal"), [0]
    for last in (1, 2, 1):
        command = [sys.executable, "-P", "-c", KILLED, str(last), "sweep", CASE, *over, "--out", str(parts)]
        assert subprocess.run(command, capture_output=True, check=False).returncode == -signal.SIGKILL
        sizes.append(journal.stat().st_size)
        assert not journal.read_bytes().endswith(b"\n")
    assert sizes == sorted(sizes)
    assert not parts.exists()
    assert cli("sweep", CASE, *over, "--out", str(parts))[0] == 0
    found = answers(parts)
    assert len(found) == 300
    assert found == answers(whole)


@pytest.mark.slow
def test_processes_of_ipopt_and_one_that_is_killed(sweep: Callable[..., Sweep]) -> None:
    one = sweep("x1=10:14:12", starts=2)
    chosen = tuple(map(tuple, one.points.values.tolist()))
    job = Job(one.source, one.points.names, chosen, 2, None, EngineKind.IPOPT)
    blocks = [PointBlock([k], one.points.values[[k]]) for k in range(12)]
    found: list[Row] = []
    for rows in answer_in_processes(job, iter(blocks), 2):
        found += rows
        if len(found) == 3:
            children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
            spawned = [pid for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
            os.kill(int(spawned[0]), signal.SIGKILL)
    assert sorted(row.point for row in found) == list(range(12))
    alone = solve(load_case(CASE, one.points.settings(7)), starts=2, jobs=1)
    assert [row.F for row in found if row.point == 7] == pytest.approx([alone.F], rel=1e-12)


@needs_compiler
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_worker(sweep: Callable[..., Sweep], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    one = sweep("task.pitch=0:2:30", "x1=10:14:100", starts=2)
    options = {"threads_per_worker": 1, "processes": True, "dashboard_address": None, "scheduler_port": 0}
    with distributed.LocalCluster(n_workers=2, **options) as cluster:
        journal, killed = one.journal_of(str(tmp_path / "out.csv")), list[int]()

        def kill(_before: int, done: int, total: int, _seconds: float) -> None:
            if not killed and done < total:
                worker = next(iter(cluster.workers.values()))
                killed.append(worker.pid)
                os.kill(worker.pid, signal.SIGKILL)

        run_sweep(one, journal, dask=cluster.scheduler_address, progress=kill)
        rows = list(journal.rows())
        journal.close()
    assert len(killed) == 1
    assert [row.point for row in rows] == list(range(3000))
    here = replace(one, points=Points(one.points.names, one.points.values[::1000]))
    local = here.journal_of(str(tmp_path / "local.csv"))
    run_sweep(here, local, engine=EngineKind.COMPILED)
    assert [row.F for row in local.rows()] == pytest.approx([row.F for row in rows[::1000]], rel=SAME)
    local.close()


@pytest.mark.slow
def test_an_unreachable_cluster(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "_WAIT", 0.2)
    out = tmp_path / "out.csv"
    code, _, err = cli("sweep", CASE, *OVER, "--dask", "tcp://127.0.0.1:9", "--out", str(out))
    assert (code, out.exists()) == (2, False)
    assert "no Dask scheduler answers at this address" in err.splitlines()[-1]
