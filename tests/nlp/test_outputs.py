"""Outputs never destroy inputs, one another, or files of another origin."""

import os
from pathlib import Path
from threading import Thread

import pytest
from builders import Run, output_of, saved

from screwsynth.nlp import InputError
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.output.files import MANIFEST, check_folder, write_folder
from screwsynth.nlp.system.locks import held_folder

TEXT = find_case("paper-4.1-helical").read_text(encoding="utf-8")
# Each command with an output in the place of OUT.
COMMANDS = [
    ("solve", "CASE", "--starts", "1", "--json", "OUT"),
    ("evaluate", "CASE", "--json", "OUT"),
    ("certify", "CASE", "--starts", "1", "--json", "OUT"),
    ("certify", "CASE", "--starts", "1", "--proof", "OUT"),
    ("check", "CASE", "--json", "OUT"),
    ("check", "CASE", "--junit", "OUT"),
    ("report", "CASE", "--starts", "1", "--out", "OUT"),
    ("pareto", "CASE", "--goal", "max F", "--goal", "min limits.x", "--csv", "OUT"),
    ("compare", "CASE", "6-ups", "delta", "--csv", "OUT"),
]


@pytest.fixture
def case(tmp_path: Path) -> Path:
    return saved(tmp_path / "case.toml", TEXT)


def refused(answer: tuple[int, str, str], *words: str) -> None:
    code, out, err = answer
    assert (code, out, len(err.splitlines())) == (2, "", 1), answer
    for word in words:
        assert word in err


@pytest.mark.parametrize(
    ("command", "way"),
    [
        *((command, "itself") for command in COMMANDS),
        *((COMMANDS[0], way) for way in ("another path", "soft link", "hard link")),
        (COMMANDS[3], "soft link"),
        (COMMANDS[6], "hard link"),
    ],
)
def test_an_output_that_is_the_case_file(command: tuple[str, ...], way: str, case: Path, cli: Run) -> None:
    out = case
    if way == "another path":
        out = case.parent / "sub" / ".." / "case.toml"
        (case.parent / "sub").mkdir()
    elif way == "soft link":
        out = case.parent / "link.toml"
        out.symlink_to(case)
    elif way == "hard link":
        out = case.parent / "hard.toml"
        os.link(case, out)
    refused(cli(*[{"CASE": str(case), "OUT": str(out)}.get(word, word) for word in command]), "is the case file")
    assert case.read_text(encoding="utf-8") == TEXT


def test_a_picture_that_is_the_case_file(tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / "case.svg", TEXT)
    refused(cli("solve", str(path), "--starts", "1", "--plot", str(path)), "--plot", "is the case file")
    assert path.read_text(encoding="utf-8") == TEXT


# A robot whose poses and tasks stand in files of their own; the ending is that of a picture.
NAMED = """\
poses = "poses.svg"
tasks = "sub/tasks.svg"
[robot]
model = "stewart-gough"
parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = { min = 5, max = 20 } }
"""
ROWS = {
    "poses.svg": "x,y,z\n0,0,30\n",
    "sub/tasks.svg": "sense,axis_x,axis_y,axis_z,point_x,point_y,point_z,pitch\nmax,0,0,1,0,0,6,1\n",
}
OVER = ("--over", "x1=11:12:2")


@pytest.mark.parametrize(
    "command",
    [
        *COMMANDS,
        ("solve", "CASE", "--csv", "OUT"),
        ("solve", "CASE", "--plot", "OUT"),
        ("evaluate", "CASE", "--csv", "OUT"),
        *(("tradeoff", "CASE", *OVER, option, "OUT") for option in ("--json", "--csv", "--html", "--plot")),
    ],
    ids=" ".join,
)
def test_an_output_that_is_a_file_that_the_case_names(command: tuple[str, ...], tmp_path: Path, cli: Run) -> None:
    case, link = tmp_path / "case.toml", tmp_path / "link.svg"
    (tmp_path / "sub").mkdir()
    case.write_text(NAMED, encoding="utf-8")
    for name, rows in ROWS.items():
        (tmp_path / name).write_text(rows, encoding="utf-8")
    link.symlink_to(tmp_path / "sub" / "tasks.svg")
    for out in (tmp_path / "poses.svg", tmp_path / "sub" / "tasks.svg", link):
        answer = cli(*[{"CASE": str(case), "OUT": str(out)}.get(word, word) for word in command])
        refused(answer, command[-2], out.name, "is a file that the case names")
    assert {name: (tmp_path / name).read_text(encoding="utf-8") for name in ROWS} == ROWS


def test_codegen_over_a_file_that_the_case_names(tmp_path: Path, cli: Run) -> None:
    case = tmp_path / "case.toml"
    made = tmp_path / "made"
    made.mkdir()
    name = "Makefile"
    (made / name).write_text(ROWS["poses.svg"], encoding="utf-8")
    case.write_text(NAMED.replace("poses.svg", f"made/{name}").replace("sub/", ""), encoding="utf-8")
    (tmp_path / "tasks.svg").write_text(ROWS["sub/tasks.svg"], encoding="utf-8")
    refused(cli("codegen", str(case), "--out", str(made), "--force"), name, "is a file that the case names")
    assert [(each.name, each.read_text(encoding="utf-8")) for each in made.iterdir()] == [(name, ROWS["poses.svg"])]


@pytest.mark.parametrize(
    "command",
    [
        ("solve", "CASE", "--starts", "1", "--json", "ONE", "--plot", "TWO"),
        ("certify", "CASE", "--starts", "1", "--json", "ONE", "--proof", "TWO"),
        ("check", "CASE", "--json", "ONE", "--junit", "TWO"),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("linked", [False, True])
def test_two_outputs_in_one_file(command: tuple[str, ...], linked: bool, case: Path, cli: Run) -> None:
    one, two = case.parent / "made.svg", case.parent / "made.svg"
    if linked:
        two = case.parent / "link.svg"
        two.symlink_to(one)
    names = {"CASE": str(case), "ONE": str(one), "TWO": str(two)}
    refused(cli(*[names.get(word, word) for word in command]), command[-2], command[-4])
    assert not one.exists()


def test_a_device_takes_two_outputs(case: Path, cli: Run) -> None:
    output_of(cli("check", str(case), "--json", os.devnull, "--junit", os.devnull))


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_file_that_is_read_only(command: tuple[str, ...], case: Path, cli: Run) -> None:
    kept = case.parent / "kept.txt"
    kept.write_text("kept", encoding="utf-8")
    kept.chmod(0o444)
    refused(cli(*[{"CASE": str(case), "OUT": str(kept)}.get(word, word) for word in command]), "read-only")
    assert kept.read_text(encoding="utf-8") == "kept"


def test_a_folder_of_somebody_else(case: Path, cli: Run) -> None:
    folder = case.parent / "project"
    folder.mkdir()
    (folder / "Makefile").write_text("mine", encoding="utf-8")
    link = case.parent / "link"
    link.symlink_to(folder)
    for target in (folder, link):
        refused(cli("codegen", str(case), "--out", str(target)), "Makefile", "--force")
    assert [each.name for each in folder.iterdir()] == ["Makefile"]
    assert (folder / "Makefile").read_text(encoding="utf-8") == "mine"


def test_codegen_over_the_folder_of_its_own_case(case: Path, cli: Run) -> None:
    # The case file lies where the copy of the case goes.
    refused(cli("codegen", str(case), "--out", str(case.parent), "--force"), "is the case file")
    assert [each.name for each in case.parent.iterdir()] == ["case.toml"]


def test_a_folder_written_before(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    write_folder(str(folder), {"a.c": "1", "b.c": "1"})
    write_folder(str(folder), {"a.c": "2"})
    assert (folder / "a.c").read_text(encoding="utf-8") == "2"
    # What was written two times ago may be replaced as well; what the user put there may not.
    write_folder(str(folder), {"b.c": "3"})
    (folder / "mine.c").write_text("mine", encoding="utf-8")
    write_folder(str(folder), {"b.c": "4"})
    with pytest.raises(InputError, match=r"mine\.c"):
        write_folder(str(folder), {"b.c": "5", "mine.c": "5"})
    assert (folder / "mine.c").read_text(encoding="utf-8") == "mine"
    assert (folder / "b.c").read_text(encoding="utf-8") == "4"
    write_folder(str(folder), {"b.c": "5", "mine.c": "5"}, force=True)
    assert (folder / "mine.c").read_text(encoding="utf-8") == "5"
    assert {"a.c", "b.c", "mine.c"} <= set((folder / MANIFEST).read_text(encoding="utf-8").splitlines())


def test_two_runs_write_one_folder_one_after_the_other(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    write_folder(str(folder), {"a.c": "1"})
    second = Thread(target=write_folder, args=(str(folder), {"b.c": "2"}))
    with held_folder(folder):
        # The first run is in the middle of its writing: files without a manifest, in a folder that is not its own yet.
        (folder / MANIFEST).unlink()
        (folder / ".screwsynth.begun").mkdir()
        second.start()
        second.join(0.2)
        assert second.is_alive()
        (folder / ".screwsynth.begun").rmdir()
        (folder / MANIFEST).write_text(
            "# Written by screwsynth, which may replace these files:\na.c\n", encoding="utf-8"
        )
    second.join()
    assert (folder / MANIFEST).read_text(encoding="utf-8").splitlines()[1:] == ["a.c", "b.c"]
    assert sorted(each.name for each in folder.iterdir()) == ["a.c", "b.c", MANIFEST]
    # What a killed run left refuses no other one.
    (folder / ".screwsynth.left").mkdir()
    (folder / MANIFEST).unlink()
    (folder / "a.c").unlink()
    (folder / "b.c").unlink()
    check_folder(str(folder))


@pytest.mark.parametrize("text", ["", "something else\n"])
def test_a_manifest_that_is_none(text: str, tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="did not write"):
        write_folder(str(tmp_path), {"a.c": "1"})
