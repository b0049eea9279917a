"""A study's progress on standard error: a live table on a terminal, plain lines anywhere else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from compare.study import Entry, Progress

Report = Callable[["Progress"], None]


@contextmanager
def shown() -> Iterator[Report]:
    """A report function for `study.run` that shows progress until the block ends."""
    if not sys.stderr.isatty():
        yield plain()
        return
    from rich.console import Console
    from rich.live import Live

    console = Console(stderr=True)
    with Live(console=console, refresh_per_second=8, transient=True) as live:
        yield lambda progress: live.update(_drawn(progress, console))


def plain() -> Report:
    """Reports each finished unit once, as a line."""
    told = 0

    def report(progress: Progress) -> None:
        nonlocal told
        for entry in progress.finished[told:]:
            told += 1
            if entry.fresh:
                left = "" if progress.seconds_left is None else f", about {duration(progress.seconds_left)} left"
                print(f"[{told}/{progress.total}] {line(entry)}{left}", file=sys.stderr, flush=True)

    return report


def line(entry: Entry) -> str:
    """A finished entry in words: what, answer, time, status."""
    from compare.study import label
    from compare.table import shown

    value = shown(entry)
    result = "" if value is None else f" {value}"
    seconds = "" if entry.wall_seconds is None else f" in {entry.wall_seconds:.2f} s"
    return f"{label(entry)}{result}{seconds}{'' if entry.ok else f' {entry.status}'}"


def duration(seconds: float) -> str:
    """Seconds for people: "8 s", "3 min 20 s"."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _drawn(progress: Progress, console: Console) -> RenderableType:
    """Finished rows that fit the terminal, a bar per running unit, and the time left."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

    fresh = [entry for entry in progress.finished if entry.fresh]
    room = max(3, console.height - len(progress.running) - 6)
    bars = Table.grid(padding=(0, 2))
    for label, fraction in progress.running:
        bars.add_row(label, ProgressBar(total=1, completed=fraction, width=24), f"{100 * fraction:3.0f} %")
    reused = len(progress.finished) - len(fresh)
    left = "" if progress.seconds_left is None else f", about {duration(progress.seconds_left)} left"
    summary = Text(f"{len(progress.finished)} of {progress.total} done, {reused} reused{left}")
    return Group(_finished(fresh[-room:]), bars, summary)


def _finished(entries: list[Entry]) -> RenderableType:
    """A table of finished entries, each against the printed value where there is one."""
    from rich.box import SIMPLE
    from rich.table import Table

    from compare.formats import cell
    from compare.study import level_name
    from compare.table import error, paper_value, rule, shown

    drawn = Table(box=SIMPLE, pad_edge=False, header_style="bold")
    for heading in ("scene", "variant", "solver", "mesh", "points", "answer", "paper %", "s", "status"):
        drawn.add_column(heading, justify="right" if heading in ("answer", "paper %", "s") else "left", no_wrap=True)
    for entry in entries:
        paper = paper_value(entry)
        drawn.add_row(
            entry.scene.name,
            entry.variant or "",
            entry.solver,
            level_name(entry.level),
            rule(entry.level) or "",
            shown(entry) or "–",
            cell("error_paper_percent", error(entry, paper and paper.value)),
            cell("wall_seconds", entry.wall_seconds),
            entry.status,
            style=None if entry.ok else "red",
        )
    return drawn
