"""The index: one page over all studies whose JSON lies in a folder, with verdict, margins and date."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from compare.files import write_text
from compare.history import asked_of, used
from compare.report import Column, Link, Page, Section, Table, Text, render
from compare.result import OK

NAME = "index.html"
COLUMNS = (
    Column("page", "page", "link"),
    Column("study", "study"),
    Column("verdict", "verdict", "tag"),
    Column("judged", "met"),
    Column("worst", "nearest to its bar", "wrap"),
    Column("part", "of its bar", ",.1f", "%"),
    Column("budget", "budget"),
    Column("date", "date"),
    Column("commit", "commit"),
    Column("size", "size", ".2f", "MB"),
)


def write(folder: Path) -> Path:
    """Write index.html over the studies of a folder; returns its path."""
    path = folder / NAME
    write_text(path, render(page(folder)))
    return path


def page(folder: Path) -> Page:
    """The index as a page. A JSON that cannot be read is named, and left out."""
    rows, unread = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            rows.append(_row(path, json.loads(path.read_text(encoding="utf-8"))))
        except (ValueError, KeyError, TypeError, AttributeError, OSError) as error:
            unread.append(f"{path.name} is no page's JSON: {type(error).__name__}.")
    rows.sort(key=lambda row: (row["verdict"] != "missed", row["page"].text))
    judged, met = sum(row["asked"] for row in rows), sum(row["met"] for row in rows)
    words = (
        f"{len(rows)} {'study' if len(rows) == 1 else 'studies'}, {met} of {judged} judged figures met."
        if rows
        else "No study has been run yet."
    )
    broken = sum(row["failed"] > 0 for row in rows)
    words += f" Runs failed in {broken}." if broken else ""
    table = Table("Studies", COLUMNS, rows, [NOTE, *unread])
    return Page("Groovecheck", LEAD, [Section("studies", "Studies", [Text([words]), table])], FOOTER)


def _row(path: Path, content: dict[str, Any]) -> dict[str, Any]:
    """What the index says of a study's JSON."""
    figures, about = content["figures"], content["provenance"]
    asked = asked_of(figures)
    parts = {name: used(figure) for name, figure in figures.items()}
    parts = {name: part for name, part in parts.items() if part is not None}
    worst = max(parts, key=parts.get, default=None)
    label = content.get("notes", {}).get(worst, {}).get("label", worst)
    met = sum(bool(figure["met"]) for figure in asked)
    html, runs = path.with_suffix(".html"), _runs(content)
    return {
        "page": Link(quote(html.name), str(content.get("title") or path.stem)),
        "study": path.stem,
        "verdict": _verdict(asked, runs),
        "failed": len(runs) - sum(runs),
        "asked": len(asked),
        "met": met,
        "judged": f"{met} of {len(asked)}",
        "worst": label,
        "part": None if worst is None else 100 * parts[worst],
        "budget": content.get("budget") or about.get("budget"),
        "date": str(about.get("date", ""))[:10],
        "commit": about.get("commit"),
        "size": html.stat().st_size / 1e6,
    }


def _runs(content: dict[str, Any]) -> list[bool]:
    """Whether each run of a study that says so succeeded; the modes of a run, a row each, count once."""
    rows = [row for row in content.get("rows") or () if row.get("mode") in (None, 1)]
    return [row["status"] == OK for row in (*rows, *(content.get("sensitivity") or ())) if "status" in row]


def _verdict(asked: Sequence[dict[str, Any]], runs: Sequence[bool]) -> str:
    """One word for the figures of which something is asked; a figure that was not run lets no study be met. Of a study
    that asks nothing, how many of its runs succeeded where some failed."""
    states = {figure.get("met") for figure in asked}
    if not states:
        return "stated" if all(runs) else f"{sum(runs)} of {len(runs)} runs succeeded"
    return "missed" if False in states else "not all run" if None in states else "met"


LEAD = "How far a fast plate model can be trusted, and what it costs to be right: every study of this folder."
NOTE = (
    "Met: judged figures within their bars, of all that are judged; not all run: some of them have no value in this "
    "budget, or their runs failed. Nearest to its bar: the judged figure that uses the largest part of it, "
    "met up to 100 %. Stated: the study states figures and asks nothing of them, and all of its runs succeeded."
)
FOOTER = "A pass is evidence, not proof: each page says what it does not prove."
