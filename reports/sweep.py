"""The page of a sweep: every row of many scenes in one table that a reader sorts and filters."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.provenance import provenance
from compare.report import Column, Page, Section, Table, Text, write
from compare.verdict import at_most
from reports import sections

NAME = "sweep"
LEAD = "Every level of every scene of a sweep. Click a header to sort, type to filter."


def publish(scenes: Sequence[str], rows: Sequence[dict[str, Any]], budget: str, folder: Path) -> Path:
    """Write sweep.html and sweep.json into `folder`; returns the page's path. scenes: the scene's name of each row."""
    named = [{"scene": scene, **row} for scene, row in zip(scenes, rows, strict=True)]
    failed = [row for row in named if row["status"] != "ok"]
    count = len({row["scene"] for row in named})
    figure = at_most("levels_failed", "Levels that failed", len(failed), "", 0, against="each solver's own status")
    content = {
        "figures": {figure.name: figure.entry()},
        "notes": {figure.name: figure.words()},
        "budget": budget,
        "rows": named,
        "provenance": provenance(),
    }
    columns = [Column("scene", "scene"), *sections.COLUMNS]
    columns = [column for column in columns if any(row.get(column.key) is not None for row in named)]
    table = Table("All rows", columns, named, ["Frequencies are in Hz, heights in m."])
    words = f"{count} scenes, {len(named)} rows, {len(failed)} of them without a value."
    parts = [Section("rows", "Rows", [Text([words]), table])]
    return write(folder, NAME, Page("Sweep", LEAD, parts, f"Groovecheck, {content['provenance']['date']}"), content)
