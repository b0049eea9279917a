"""History: the figures of every page that was written, one line of JSON each, beside the commit that made them.

The file (history.jsonl) is only ever appended to, each line by one write under a lock, so that two runs in one
folder lose nothing; a line that a killed process left half-written is passed over.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any

FILE = "history.jsonl"
KEPT = 60  # newest records of a study that a page shows

Record = dict[str, Any]


def record(name: str, content: dict[str, Any]) -> Record:
    """What is kept of a page's JSON: study, budget, date, commit, machine, and each figure with its bar."""
    about = content.get("provenance", {})
    return {
        "study": name,
        "budget": content.get("budget") or about.get("budget"),
        **{key: about.get(key) for key in ("date", "commit", "machine")},
        "figures": content.get("figures", {}),
    }


def append(folder: Path, entry: Record) -> None:
    """Add a record to the folder's history."""
    line = (json.dumps(entry, allow_nan=False, ensure_ascii=False) + "\n").encode("utf-8")
    with (folder / FILE).open("ab") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        if file.tell() and not _ends_a_line(folder / FILE):
            line = b"\n" + line
        os.write(file.fileno(), line)


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"


def read(folder: Path, study: str) -> list[Record]:
    """Records of a study, oldest first, the newest KEPT of them; lines that cannot be read are passed over."""
    try:
        lines = (folder / FILE).read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return []
    found = [entry for entry in map(_parsed, lines) if entry and entry["study"] == study]
    return found[-KEPT:]


def _parsed(line: str) -> Record | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    good = isinstance(entry, dict) and isinstance(entry.get("figures"), dict) and "study" in entry
    return entry if good and all(isinstance(figure, dict) for figure in entry["figures"].values()) else None


def asked_of(figures: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """The figures with a verdict or a bar: one that was not run is asked for as well."""
    return [figure for figure in figures.values() if figure.get("met") is not None or figure.get("bar") is not None]


def used(figure: dict[str, Any]) -> float | None:
    """Part of its bar that a figure uses: met up to 1, whether the bar is a floor or a ceiling.

    None where it has no value, or no bar to divide by.
    """
    value, bar, met = figure.get("value"), figure.get("bar"), figure.get("met")
    numbers = all(isinstance(number, (int, float)) and not isinstance(number, bool) for number in (value, bar))
    if met is None or not numbers or not bar:
        return None
    if not value:
        return 0.0 if met else None
    reach = abs(value / bar)
    return min(reach, 1 / reach) if met else max(reach, 1 / reach)
