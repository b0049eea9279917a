"""Where every probe of a scene went: the answer is read at the first one alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.report import Column, Section, Table
from compare.study import Entry, level_name
from reports.ladders import ladders, scenes

COLUMNS = (
    Column("scene", "scene"),
    Column("ladder", "ladder"),
    Column("mesh", "mesh"),
    Column("probe", "probe"),
    *(Column(f"u_{axis}", f"displacement u_{axis}", ".6g", "m") for axis in "xyz"),
)


def rows(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Displacements (m) at the last output of each ladder's finest level, of scenes with several probes."""
    return [
        {"scene": scene.name, "ladder": ladder.label, "mesh": level_name(ladder.finest.level), "probe": name}
        | dict(zip(("u_x", "u_y", "u_z"), moved.tolist(), strict=True))
        for scene in scenes(entries)
        if len(scene.probes) > 1
        for ladder in ladders(entries, scene.name)
        if ladder.finest
        for name, moved in zip(ladder.finest.result.probes, ladder.finest.result.displacement[-1], strict=True)
    ]


def section(found: Sequence[dict[str, Any]]) -> Section | None:
    """Where every probe went, where there are several."""
    table = Table("Probes at the last output, finest levels", COLUMNS, found)
    return Section("probes", "All probes", [table], "Probes") if found else None
