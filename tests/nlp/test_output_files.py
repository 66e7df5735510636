"""Outputs: they destroy no input and no file of another origin, and names in them stay text."""

import csv
import html
import io
import os
import re
import unicodedata
import xml.etree.ElementTree as ET
from pathlib import Path
from threading import Thread

import pytest
from builders import Run, edited, output_of, refusal_of, saved, saved_with_robot

from screwsynth.nlp import InputError, generate_c, load_case
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.output.files import MANIFEST, check_folder, check_origin, write_folder
from screwsynth.nlp.output.sweeptable import table_rows
from screwsynth.nlp.sweeps.points import CaseSource, grid
from screwsynth.nlp.sweeps.sweep import Sweep
from screwsynth.nlp.system.csvtext import csv_row, csv_text, text_of_cell
from screwsynth.nlp.system.locks import held_folder
from screwsynth.nlp.system.markdown import markdown_text

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


def with_names(command: tuple[str, ...], **paths: Path) -> list[str]:
    """Arguments with paths in the place of words."""
    return [str(paths.get(word, word)) for word in command]


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
    (case.parent / "sub").mkdir()
    out = case if way == "itself" else case.parent / ("sub/../case.toml" if way == "another path" else "link.toml")
    if way == "soft link":
        out.symlink_to(case)
    elif way == "hard link":
        os.link(case, out)
    refusal_of(cli(*with_names(command, CASE=case, OUT=out)), "is the case file")
    assert case.read_text(encoding="utf-8") == TEXT


def test_a_picture_that_is_the_case_file_and_a_device_for_two_outputs(tmp_path: Path, cli: Run, case: Path) -> None:
    path = saved(tmp_path / "case.svg", TEXT)
    refusal_of(cli("solve", str(path), "--starts", "1", "--plot", str(path)), "--plot", "is the case file")
    assert path.read_text(encoding="utf-8") == TEXT
    output_of(cli("check", str(case), "--json", os.devnull, "--junit", os.devnull))


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
        answer = cli(*with_names(command, CASE=case, OUT=out))
        refusal_of(answer, command[-2], out.name, "is a file that the case names")
    assert {name: (tmp_path / name).read_text(encoding="utf-8") for name in ROWS} == ROWS


def test_codegen_over_a_file_that_the_case_names(tmp_path: Path, cli: Run) -> None:
    made = tmp_path / "made"
    made.mkdir()
    makefile = saved(made / "Makefile", ROWS["poses.svg"])
    case = saved(tmp_path / "case.toml", NAMED.replace("poses.svg", "made/Makefile").replace("sub/", ""))
    saved(tmp_path / "tasks.svg", ROWS["sub/tasks.svg"])
    refusal_of(cli("codegen", str(case), "--out", str(made), "--force"), "Makefile", "is a file that the case names")
    assert list(made.iterdir()) == [makefile]
    assert makefile.read_text(encoding="utf-8") == ROWS["poses.svg"]


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
    one = case.parent / "made.svg"
    two = case.parent / "link.svg" if linked else one
    if linked:
        two.symlink_to(one)
    refusal_of(cli(*with_names(command, CASE=case, ONE=one, TWO=two)), command[-2], command[-4])
    assert not one.exists()


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_file_that_is_read_only(command: tuple[str, ...], case: Path, cli: Run) -> None:
    kept = saved(case.parent / "kept.txt", "kept")
    kept.chmod(0o444)
    refusal_of(cli(*with_names(command, CASE=case, OUT=kept)), "read-only")
    assert kept.read_text(encoding="utf-8") == "kept"


def test_a_folder_of_somebody_else(case: Path, cli: Run) -> None:
    # The case file lies where the copy of the case goes.
    refusal_of(cli("codegen", str(case), "--out", str(case.parent), "--force"), "is the case file")
    assert list(case.parent.iterdir()) == [case]
    folder, link = case.parent / "project", case.parent / "link"
    folder.mkdir()
    mine = saved(folder / "Makefile", "mine")
    link.symlink_to(folder)
    for target in (folder, link):
        refusal_of(cli("codegen", str(case), "--out", str(target)), "Makefile", "--force")
    assert list(folder.iterdir()) == [mine]
    assert mine.read_text(encoding="utf-8") == "mine"


def test_a_folder_written_before(tmp_path: Path) -> None:
    folder = tmp_path / "made"

    def texts() -> list[str]:
        return [(folder / name).read_text(encoding="utf-8") for name in ("a.c", "b.c", "mine.c")]

    write_folder(str(folder), {"a.c": "1", "b.c": "1"})
    write_folder(str(folder), {"a.c": "2"})
    # What was written two times ago may be replaced as well; what the user put there may not.
    write_folder(str(folder), {"b.c": "3"})
    saved(folder / "mine.c", "mine")
    write_folder(str(folder), {"b.c": "4"})
    with pytest.raises(InputError, match=r"mine\.c"):
        write_folder(str(folder), {"b.c": "5", "mine.c": "5"})
    assert texts() == ["2", "4", "mine"]
    write_folder(str(folder), {"b.c": "5", "mine.c": "5"}, force=True)
    assert texts() == ["2", "5", "5"]
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
        saved(folder / MANIFEST, "# Written by screwsynth, which may replace these files:\na.c\n")
    second.join()
    assert (folder / MANIFEST).read_text(encoding="utf-8").splitlines()[1:] == ["a.c", "b.c"]
    assert sorted(each.name for each in folder.iterdir()) == ["a.c", "b.c", MANIFEST]
    # What a killed run left refuses no other one.
    (folder / ".screwsynth.left").mkdir()
    for name in (MANIFEST, "a.c", "b.c"):
        (folder / name).unlink()
    check_folder(str(folder))


def test_a_manifest_that_is_none(tmp_path: Path) -> None:
    for text in ("", "something else\n"):
        saved(tmp_path / MANIFEST, text)
        with pytest.raises(InputError, match="not written by screwsynth"):
            write_folder(str(tmp_path), {"a.c": "1"})


def test_an_import_writes_over_its_own_files_only(tmp_path: Path) -> None:
    target, beginning = tmp_path / "robot.toml", "# Imported by screwsynth from "
    check_origin(str(target), beginning)
    check_origin(str(saved(target, f"{beginning}a.xml\n")), beginning)
    check_origin(str(saved(target, "# my own notes\n")), beginning, force=True)
    with pytest.raises(InputError, match=r"robot\.toml: exists, and screwsynth did not write it: .* or --force"):
        check_origin(str(target), beginning)


# Colour, title of the window, bell, carriage return, newline, marks of direction, a space without width.
EVIL = "\\u001b[31mred \\u001b]0;owned\\u0007 \\r\\nnew \\u202eright \\u2066 \\u200b \\u0085 \\u2028 \\u007f"
UNIT = "\\u001b[7m\\u202e\\r\\nnew"
SIGNS = ["\x1b", "\x07", "\r", "\u202e", "\u2066", "\u200b", "\x85", "\u2028", "\x7f"]


@pytest.fixture
def hostile_case(tmp_path: Path) -> str:
    text = find_case("paper-4.1-helical").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("title", "name =", "length ="))]
    text = "\n".join(lines).replace("[units]", f'[units]\nlength = "{UNIT}"', 1)
    text = text.replace("[[task]]", f'[[task]]\nname = "{EVIL}"', 1)
    return str(saved(tmp_path / "case.toml", f'title = "{EVIL} 日本\u3000語"\n{text}\n[solve]\nstarts = 2\n'))


def controls(text: str) -> list[str]:
    return [char for char in text if char != "\n" and unicodedata.category(char) in ("Cc", "Cf", "Zl", "Zp")]


@pytest.mark.parametrize("command", ["solve", "evaluate", "certify", "check"])
def test_on_the_terminal(command: str, hostile_case: str, cli: Run) -> None:
    _, out, err = cli(command, hostile_case)
    assert not controls(out + err)
    assert "\nnew" not in out
    assert command == "check" or "日本\u3000語" in out
    assert command == "check" or "\\x1b[31mred" in out.replace("\n", "")


def test_as_markdown_junit_and_comments_of_c(hostile_case: str, cli: Run) -> None:
    with open(hostile_case, "a", encoding="utf-8") as file:
        row = 'quantity = "F"\nvalue = 1\nreproduced = false'
        file.write(f'[[published]]\n{row}\nsource = "{EVIL}"\nbecause = "{EVIL}"\n')
    out, junit = (cli("check", hostile_case, *options)[1] for options in (("--markdown",), ("--junit", "-")))
    assert "red" in out
    assert not controls(out + junit)
    ET.fromstring(junit)
    files = generate_c(load_case(hostile_case), "")
    assert any("[31mred" in text for text in files.values())
    for name, text in files.items():
        assert not [char for char in controls(text) if char != "\t"], name
        assert not any(sign in text for sign in SIGNS), name


FORMULAS = ["=1+1", "+1+cmd|' /C calc'!A0", "-2+3+cmd|' /C calc'!A0", "@SUM(1)", '=HYPERLINK("http://x")', "-a", "\t=1"]
#: What the program writes itself, beginning with a sign.
NUMBERS = [
    *("-1", "+0.25", "-1e-300", "-.5", "-inf", "+1 mm/mm", "+737.3 F per 1", "-0.2907 F/(mm N)", "-90 .. 90"),
    *("-0.1, 0.2, -3", "-1.5; 2", "-5 to 5 deg", "-", "+"),
]
ROBOT = """
name = "<script>alert(1)</script> | [a](http://b) `c` _d_ *e* & www.f.g @h"
home = [0, 0, "h"]
dimensions = { rb = { typical = 1.0 }, rp = { typical = 0.6 }, h = { typical = 1.1 } }
[[limb]]
repeat = { count = 3 }
points = { B = ["rb", 0, 0], A = ["rp", 0, "h"] }
joints = [
  { type = "R", at = "B", axis = "y" },
  { type = "P", at = "B", axis = "A - B", actuated = true },
  { type = "S", at = "A" },
]
"""
CASE = """
title = "<img src=x onerror=alert(1)>"
robot = { file = "robot.toml", parameters = { rb = 1, rp = 0.6, h = { min = 1, max = 1.2 } } }
pose = { position = [0, 0, 1.1] }
[[task]]
name = "=1+1*cmd"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[task]]
name = "@b"
sense = "max"
axis = [1, 0, 0]
point = [0, 0, 1.1]
pitch = 0
"""


def test_cells_that_are_formulas_are_quoted_and_numbers_and_other_texts_stay() -> None:
    for text in FORMULAS:
        assert csv_row([text]) == [f"'{text}"]
        assert text_of_cell(f"'{text}") == text
        assert list(csv.reader(io.StringIO(csv_text([text, "x"], [])))) == [[f"'{text}", "x"]]
    for text in [*NUMBERS, "a=b", "x -1", "", "'quoted", "M3"]:
        assert csv_row([text, -1.5, None]) == [text, -1.5, None]
        assert text_of_cell(text) == text


def test_no_table_of_a_case_begins_a_cell_with_a_formula(tmp_path: Path, cli: Run) -> None:
    path, out = saved_with_robot(tmp_path, ROBOT, CASE), tmp_path / "out.csv"
    assert cli("solve", path, "--starts", "4", "--csv", str(out))[0] == 0
    cells = [cell for row in csv.reader(io.StringIO(out.read_text(encoding="utf-8"))) for cell in row]
    assert {"'=1+1*cmd", "'@b"} <= set(cells)
    assert all(csv_row([each]) == [each] for each in cells if each[:1] in ("=", "+", "-", "@"))
    # Numbers stay numbers.
    cli("evaluate", "paper-4.1-helical", "--csv", str(out))
    signed = [each for each in re.split(r"[,\n]", out.read_text(encoding="utf-8")) if re.match(r"-\d\S*$", each)]
    assert len(signed) > 10
    assert all(float(each) <= 0 for each in signed)


def test_a_sweep_of_numbers_is_read_again(tmp_path: Path, cli: Run) -> None:
    single = CASE[: CASE.rindex("[[task]]")]
    path, out = saved_with_robot(tmp_path, ROBOT, single), tmp_path / "out.csv"
    assert cli("sweep", path, "--over", "rp=0.5:0.6:2", "--starts", "2", "--jobs", "1", "--out", str(out))[0] == 0
    source, points = CaseSource.from_file(read_case(path)), grid(["rp=0.5:0.6:2"])
    rows = table_rows(str(out), Sweep.of(source, points, starts=2))
    assert len(rows) == 2
    assert all(row.F > 0 and not row.active[0].startswith("'") for row in rows)


@pytest.mark.parametrize(
    ("name", "page"),
    [
        ("<script>a</script>", "&lt;script&gt;a&lt;/script&gt;"),
        ("a|b `c` [d](e)", "a\\|b \\`c\\` \\[d\\](e)"),
        ("*a* _b_ c_d ~~e~~", "\\*a\\* \\_b\\_ c_d \\~\\~e\\~\\~"),
        ("http://a www.b x@y", "http&#58;//a www&#46;b x&#64;y"),
        ("a & b; &lt;", "a &amp; b; &amp;lt;"),
        ("back\\slash\nline", "back\\\\slash\\\\nline"),
        ("paper-4.1-helical", "paper-4.1-helical"),
    ],
)
def test_names_in_markdown_are_shown_as_they_are_written(name: str, page: str) -> None:
    assert markdown_text(name) == page
    # A viewer takes entities and marks away again.
    shown = html.unescape(re.sub(r"\\([\\`*\[\]|~_])", r"\1", page))
    assert shown == name.replace("\n", "\\n")


def test_pages_of_exports_have_names_as_text(tmp_path: Path, cli: Run) -> None:
    fixed = edited(CASE, ("h = { min = 1, max = 1.2 }", "h = 1.1"))
    path, folder = saved_with_robot(tmp_path, ROBOT, fixed), tmp_path / "out"
    status, _, err = cli("export", path, "--out", str(folder), "--format", "csv")
    assert (status, err) == (0, "")
    page = (folder / "README.md").read_text(encoding="utf-8")
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    outside = re.sub(r"`[^`\n]*`", "", page.replace("\\`", ""))
    assert not re.search(r"<[a-z/!]|(?<!\\)\[a\]|http://|www\.", outside)
    single = edited(CASE[: CASE.rindex("[[task]]")], ('"robot.toml"', f'"{tmp_path}/robot.toml"'))
    files = generate_c(load_case(str(saved(tmp_path / "c.toml", single))))
    assert files["README.md"].startswith("# &lt;img src=x onerror=alert(1)&gt;\n")
