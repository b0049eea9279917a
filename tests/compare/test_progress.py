"""Progress for people: plain lines where nobody watches, a live table on a terminal."""

import io

import pytest
from fake_solver import FAKE, small
from rich.console import Console

from compare import progress, study
from compare.study import Progress


@pytest.fixture(scope="module")
def entries(tmp_path_factory):
    return study.run([small((2, 3))], FAKE, "quick", tmp_path_factory.mktemp("results"))


def test_plain_progress_is_one_line_per_finished_unit(entries, capsys):
    report = progress.plain()
    report(Progress(2, (), (("cantilever: ancf 3x3", 0.5),), None))
    report(Progress(2, tuple(entries[:1]), (), 75.0))
    report(Progress(2, tuple(entries[:1]), (), 70.0))
    report(Progress(2, tuple(entries), (), 0.0))
    seen = capsys.readouterr()
    first, second = seen.err.splitlines()
    assert seen.out == ""
    assert first.startswith("[1/2] cantilever: ancf 2x2, 7x7x3 points -0.50250 m in ")
    assert first.endswith("about 1 min 15 s left")
    assert second.startswith("[2/2] cantilever: ancf 3x3")


def test_the_live_table_shows_rows_bars_and_the_time_left(entries):
    console = Console(width=120, height=30, file=io.StringIO())
    state = Progress(3, tuple(entries), (("cantilever: ancf 8x8", 0.25),), 8.0)
    console.print(progress._drawn(state, console))
    text = console.file.getvalue()
    for word in ("2x2", "3x3", "-0.50250", "+22.62", "ancf 8x8", " 25 %", "2 of 3 done, 0 reused, about 8 s left"):
        assert word in text


def test_without_a_terminal_progress_is_plain(entries, capsys):
    with progress.shown() as report:
        report(Progress(1, tuple(entries[:1]), (), None))
    assert capsys.readouterr().err.startswith("[1/1]")
