"""What the documents say is true: examples run, links lead somewhere, commands and files exist."""

import argparse
import doctest
import re
import shlex
import tomllib
from pathlib import Path

import pytest

import compare.convergence
import reports.speed_curves
from compare import cli
from compare.scene import load

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_examples_of_the_library_run():
    found = doctest.testfile(str(ROOT / "docs" / "library.md"), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert found.attempted > 15 and found.failed == 0


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
