"""What the documents say is true: examples run, links lead somewhere, commands and files exist."""

import argparse
import doctest
import importlib.util
import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import compare.convergence
import reports.speed_curves
from compare import cli, result
from compare.scene import load

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_examples_of_the_library_run():
    found = doctest.testfile(str(ROOT / "docs" / "library.md"), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert found.attempted > 15 and found.failed == 0


def test_the_table_of_a_results_file_has_every_array_that_one_may_hold():
    """A cell names `part.first` and then `.second` of the same part."""
    text = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    cells = [re.findall(r"`([\w.]+)`", line.split("|")[1]) for line in text.splitlines() if line.startswith("| `")]
    told = {f"{cell[0].partition('.')[0]}{name}" if name.startswith(".") else name for cell in cells for name in cell}
    kept = {*result.ARRAYS, *result.OPTIONAL}
    kept |= {f"{part}.{name}" for part, (_, names) in result.PARTS.items() for name in names}
    kept |= {f"energy.{kind}" for kind in ("kinetic", "strain", "external", "contact", "dissipated")}
    assert told == kept


@pytest.mark.parametrize("module", [compare.convergence, reports.speed_curves], ids=lambda module: module.__name__)
def test_the_examples_of_the_docstrings_run(module):
    found = doctest.testmod(module)
    assert found.attempted > 0 and found.failed == 0


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_named_files_exist(page):
    text = page.read_text(encoding="utf-8")
    links = [link.partition("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text)]
    for link in links:
        assert link.startswith("https://") or not link or (page.parent / link).exists(), link
    for name in re.findall(r"`((?:ancf|reference_fe|compare|reports|workflow|docs|tests)/[\w./-]+)`", text):
        generated = name.startswith(("reports/build", "reports/baselines/<"))
        assert generated or (ROOT / name).exists(), name


def test_the_shown_grooves_are_grooves():
    """Each is cut into a shipped plate; a wrong key or knot vector would be refused."""
    blocks = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "own_groove.md").read_text(encoding="utf-8"), re.S)
    plate = load("cantilever_plain_patch")
    grooves = [plate.override(tomllib.loads(block), "shown").grooves[0] for block in blocks]
    assert [groove.name for groove in grooves] == ["middle", "slanted"]


def shown_commands():
    for page in PAGES:
        for block in re.findall(r"```\w*\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
            for line in block.replace("\\\n", " ").splitlines():
                if line.startswith("groovecheck "):
                    yield line.partition("#")[0].strip()


@pytest.mark.parametrize("line", sorted(set(shown_commands())))
def test_a_shown_command_is_one(line):
    """The parser takes it; nothing is run."""
    try:
        assert isinstance(cli.parser().parse_args(shlex.split(line)[1:]), argparse.Namespace)
    except SystemExit as end:
        pytest.fail(f"{line}: exit status {end.code}")


def printed():
    """The rows of the README's table: (solver, mesh or size, unknowns, height in m, difference in percent)."""
    lines = re.findall(r"^\| (ANCF|reference)(.*?) \| (.*?) \| ([\d,]+) \| (.*?) m \| (.*?)%? ?\|$", README, re.M)
    found = []
    for solver, element, mesh, unknowns, height, apart in lines:
        height, apart = (word.replace("\u2212", "-").strip() for word in (height, apart))
        mesh = mesh.replace(" m", "").replace(" ", "")
        found.append((solver, element, mesh, int(unknowns.replace(",", "")), float(height), float(apart or 0)))
    return found


def test_the_readmes_table_is_the_accepted_one():
    """To its five digits; its differences are those of its own heights, in percent of the last one."""
    rows = json.loads((ROOT / "reports" / "baselines" / "cantilever.json").read_text())["rows"]
    rows = [row for row in rows if (row["load"], row["groove"]) == ("patch", "none")]
    kinds = {"the paper's": "conforming", "enriched": "enriched", "": "P2 tetrahedron"}
    checked = 0
    for _, element, mesh, _, height, apart in printed():
        kind = next(kind for word, kind in kinds.items() if word in element)
        found = [row["value"] for row in rows if row["element"] == kind and row["mesh"] == mesh]
        assert [round(value, 5) for value in found] in ([height], []), (kind, mesh)
        checked += len(found)
        assert apart == pytest.approx(100 * (height / printed()[-1][4] - 1), abs=0.006)
    assert checked == 3 and len(printed()) == 4


@pytest.mark.slow
def test_the_readmes_last_row_is_what_the_reference_finds():
    """h = 0.05 m belongs to the standard budget, which no gate runs; the unknowns of every row too."""
    from ancf.run import estimate
    from reference_fe.run import solve

    scene = load("cantilever_plain_patch")
    for solver, element, mesh, unknowns, height, _ in printed():
        if solver == "ANCF":
            kind = "enriched" if "enriched" in element else "conforming"
            levels = [e for e in scene.ladder("ancf") if e.element == kind and "x".join(map(str, e.mesh)) == mesh]
            assert estimate(scene, levels[0])["unknowns"] == unknowns
        else:
            level = next(level for level in scene.ladder("reference") if f"h={level.size:g}" == mesh)
            result = solve(scene, level)
            assert (result.unknowns, round(float(result.position("P")[-1, 2]), 5)) == (unknowns, height)


def test_the_example_of_exudyn_writes_a_table_or_says_what_is_missing(tmp_path):
    """One element, with Exudyn where it is installed; the answer of so coarse a plate is a downward one."""
    script, table = ROOT / "docs" / "examples" / "exudyn_cantilever.py", tmp_path / "exudyn.csv"
    run = subprocess.run([sys.executable, script, table, "1"], capture_output=True, text=True, cwd=ROOT)
    if importlib.util.find_spec("exudyn") is None:
        assert run.returncode == 1 and "pip install exudyn" in run.stderr and not table.exists()
    else:
        header, line = table.read_text().splitlines()
        assert header == "h,value,seconds" and -1.0 < float(line.split(",")[1]) < -0.3
