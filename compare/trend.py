"""The section that shows how a study's figures moved from one run to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare import plots
from compare.history import Record, asked_of, used
from compare.report import Column, Plots, Section, Table

DRAWN = 5  # figures at most: those nearest to their bar
ROLES = ("ancf", "reference", "difference", "third", "ancf exact")


def section(records: Sequence[Record]) -> Section | None:
    """Trend of the judged figures over the runs with the budget of the last one; None without any run."""
    alike = [entry for entry in records if entry["budget"] == records[-1]["budget"]]
    if not alike:
        return None
    rows = [_row(entry, previous) for previous, entry in zip([None, *alike], alike, strict=False)][::-1]
    worst = sorted(_judged(alike[-1]), key=lambda name: -used(alike[-1]["figures"][name]))[:DRAWN]
    blocks: list[Any] = [Plots([_plot(alike, worst)])] if worst and len(alike) > 1 else []
    columns = (
        Column("date", "date"),
        Column("commit", "commit"),
        Column("met", "met"),
        Column("worst", "nearest to its bar", "wrap"),
        Column("changed", "changed since the run before", "wrap"),
        Column("machine", "machine"),
    )
    notes = ["The part of a bar that a figure uses: met up to 100 %. Kept in history.jsonl beside this page."]
    table = Table(
        f"Runs of this page (budget: {alike[-1]['budget'] or 'not named'}), newest first", columns, rows, notes
    )
    return Section("trend", "From run to run", [*blocks, table], "Trend")


def _judged(entry: Record) -> list[str]:
    return [name for name, figure in entry["figures"].items() if used(figure) is not None]


def _row(entry: Record, previous: Record | None) -> dict[str, Any]:
    asked = asked_of(entry["figures"])
    names = _judged(entry)
    worst = max(names, key=lambda name: used(entry["figures"][name]), default=None)
    return {
        "date": str(entry["date"] or "")[:16].replace("T", " "),
        "commit": entry["commit"],
        "met": f"{sum(bool(figure['met']) for figure in asked)} of {len(asked)}",
        "worst": None if worst is None else f"{worst}: {100 * used(entry['figures'][worst]):.3g} %",
        "changed": "first run" if previous is None else _changes(entry["figures"], previous["figures"]),
        "machine": entry["machine"],
    }


def _changes(now: dict[str, Any], before: dict[str, Any]) -> str:
    """Names of the figures whose verdict changed, and how many values moved."""
    turned = [name for name in now if name in before and now[name].get("met") != before[name].get("met")]
    moved = sum(now[name].get("value") != before[name].get("value") for name in now if name in before)
    words = f"{moved} of {len(now)} values" if moved else "nothing"
    return words + (f"; verdict of {', '.join(turned)}" if turned else "")


def _plot(records: Sequence[Record], names: Sequence[str]) -> tuple[str, str]:
    lines = []
    for name, role in zip(names, ROLES, strict=False):
        known = [(i + 1, used(entry["figures"].get(name, {}))) for i, entry in enumerate(records)]
        known = [(run, part) for run, part in known if part is not None]
        lines.append(plots.Series(name, role, [run for run, _ in known], [100 * part for _, part in known]))
    words = "Part of its bar that each figure uses, run by run; above the line at 100 % it is missed."
    return plots.trend_plot("trend", "Trend of the margins", words, lines, 100.0), words
