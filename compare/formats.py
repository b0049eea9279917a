"""Rows of the table as text: JSON, CSV, Markdown, LaTeX, and tables for a terminal."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare.table import KEYS, Row, digits

if TYPE_CHECKING:
    from rich.table import Table


def as_json(table: list[Row]) -> str:
    """The rows as a JSON list."""
    return json.dumps(table, indent=1, allow_nan=False)


def as_csv(table: list[Row], scenes: Sequence[str] | None = None) -> str:
    """The rows as comma-separated values with a header line; null is an empty cell. scenes: a first column."""
    text = io.StringIO()
    writer = csv.DictWriter(text, KEYS if scenes is None else ("scene", *KEYS), lineterminator="\n")
    writer.writeheader()
    named = zip(table, scenes, strict=True) if scenes is not None else ()
    writer.writerows(table if scenes is None else ({"scene": scene, **row} for row, scene in named))
    return text.getvalue()


def as_markdown(table: list[Row]) -> str:
    """The rows as a Markdown table with rounded numbers; null is a dash."""
    lines, form = ["| " + " | ".join(KEYS) + " |", "|" + "---|" * len(KEYS)], _answers(table)
    lines += ["| " + " | ".join(cell(key, row[key], form).replace("|", "\\|") for key in KEYS) + " |" for row in table]
    return "\n".join(lines) + "\n"


def as_latex(table: list[Row]) -> str:
    """The rows as a LaTeX tabular of rounded numbers (package booktabs); columns without a value are left out."""
    kept = [key for key in KEYS if any(row[key] is not None for row in table)] or list(KEYS)
    sides = "".join("l" if all(isinstance(row[key], (str, type(None))) for row in table) else "r" for key in kept)
    lines = [f"\\begin{{tabular}}{{{sides}}}", "\\toprule", _latex_line(kept), "\\midrule"]
    form = _answers(table)
    lines += [_latex_line([cell(key, row[key], form) for key in kept]) for row in table]
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}"]) + "\n"


def _latex_line(cells: list[str]) -> str:
    return " & ".join(map(_latex, cells)) + r" \\"


def _latex(text: str) -> str:
    """Words as LaTeX prints them; a minus before a number is a minus."""
    text = "".join(LATEX.get(letter, letter) for letter in text)
    return re.sub(r"^([-+][\d.]+)$", r"$\1$", text)


LATEX = {letter: "\\" + letter for letter in "&%$#_{}"}
LATEX |= {"\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}", "–": "--"}
FORMATS = {"md": as_markdown, "tex": as_latex, "csv": as_csv, "json": as_json}
LEVELS = 3  # that a limit takes
ANSWERS = ("value", "extrapolated")
DIGITS = {"h": ".4g", "paper": ".4f", "order": ".2f", "peak_mb": ".0f"}
DIGITS |= {"error_paper_percent": "+.2f", "error_reference_percent": "+.2f", "gci_percent": ".2f"}
DIGITS |= {"wall_seconds": ".3g"}


def cell(key: str, value: Any, answers: str = ".5f") -> str:
    """A cell for people; answers: format of the values that are answers."""
    if value is None:
        return "–"
    form = answers if key in ANSWERS else DIGITS.get(key)
    return str(value) if form is None else format(value, form)


def _answers(table: Sequence[Row]) -> str:
    """Format of the answers of a table."""
    return digits(row[key] for row in table for key in ANSWERS)


HEADINGS = {
    "mode": "mode",
    "mesh": "mesh",
    "rule": "rule",
    "unknowns": "unknowns",
    "value": "answer m",
    "paper": "paper m",
    "error_paper_percent": "paper %",
    "error_reference_percent": "reference %",
    "order": "order",
    "sequence": "sequence",
    "extrapolated": "Richardson m",
    "gci_percent": "GCI %",
    "wall_seconds": "s",
    "peak_mb": "MiB",
    "status": "status",
}


IN_HERTZ = {"value": "frequency Hz", "extrapolated": "Richardson Hz"}


def as_terminal(table: list[Row]) -> list[Table]:
    """One rich table per solver, groove and load."""
    from rich.box import SIMPLE
    from rich.table import Table

    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in table:
        groups.setdefault((row["solver"], row["element"], row["groove"], row["load"]), []).append(row)
    found = []
    for (solver, element_name, groove_name, load), members in groups.items():
        vibrates = members[0]["mode"] is not None
        title = f"{solver} ({element_name}), groove: {groove_name}, " + ("modes" if vibrates else f"load: {load}")
        few = solver == "reference" and len({row["mesh"] for row in members}) < LEVELS
        caption = f"fewer than {LEVELS} levels: its own error is unknown" if few else None
        drawn = Table(
            title=title,
            caption=caption,
            caption_justify="left",
            title_justify="left",
            title_style="bold",
            box=SIMPLE,
            padding=(0, 1),
            pad_edge=False,
        )
        heading = HEADINGS | (IN_HERTZ if vibrates else {})
        kept = [key for key in heading if any(row[key] is not None for row in members)]
        for key in kept:
            drawn.add_column(heading[key], justify="left" if key in ("sequence", "status") else "right")
        form = _answers(members)
        for row in members:
            cells = (cell(key, row[key], form) for key in kept)
            drawn.add_row(*cells, style=None if row["status"] == "ok" else "red")
        found.append(drawn)
    return found
