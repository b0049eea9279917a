"""Report: tables, figures and pictures as one HTML page that needs neither network nor scripts.

A page is a list of sections, a section a list of blocks; the template draws each kind of block in its
own way. Nothing numeric is computed here: numbers are formatted, and each one on the page carries its
full value as <data value="...">, the same double that the JSON beside the page holds.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from compare.figures import Picture
from compare.verdict import Figure

DASH = "–"


@dataclass(frozen=True)
class Text:
    """Paragraphs of plain text."""

    kind: ClassVar[str] = "text"
    paragraphs: Sequence[str]


@dataclass(frozen=True)
class Bullets:
    """A list of plain sentences."""

    kind: ClassVar[str] = "bullets"
    items: Sequence[str]


@dataclass(frozen=True)
class Commands:
    """Shell commands, each with what it reproduces."""

    kind: ClassVar[str] = "commands"
    items: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Column:
    """One column of a table: key of the row, header, format, unit, hint, and the heading it shares with neighbours.

    form: a format of numbers, "text" for words on one line, "wrap" for words on several.
    """

    key: str
    header: str
    form: str = "text"
    unit: str = ""
    about: str = ""
    group: str = ""

    @property
    def css(self) -> str:
        """Class of the column's cells."""
        return self.form if self.form in ("text", "wrap") else "num"


@dataclass(frozen=True)
class Table:
    """Rows under columns. `notes` are printed below it; a row's "status" other than "ok" marks the row."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: Sequence[Column]
    rows: Sequence[dict[str, Any]]
    notes: Sequence[str] = ()

    @property
    def groups(self) -> list[tuple[str, int]]:
        """Headings shared by neighbouring columns with the number of columns each spans; empty without any."""
        runs = [(group, len(list(members))) for group, members in groupby(column.group for column in self.columns)]
        return runs if any(group for group, _ in runs) else []


@dataclass(frozen=True)
class Verdict:
    """Figures against their bars."""

    kind: ClassVar[str] = "verdict"
    figures: Sequence[Figure]


@dataclass(frozen=True)
class Plots:
    """Inline SVG plots, each with its caption."""

    kind: ClassVar[str] = "plots"
    items: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Gallery:
    """Pictures, and the names of those that could not be made with the reason."""

    kind: ClassVar[str] = "gallery"
    pictures: Sequence[Picture] = ()
    missing: Sequence[str] = ()
    reason: str = ""


@dataclass(frozen=True)
class Facts:
    """Pairs of a name and its value."""

    kind: ClassVar[str] = "facts"
    pairs: Sequence[tuple[str, Any]]


Block = Text | Bullets | Commands | Table | Verdict | Plots | Gallery | Facts


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it; `anchor` is its id on the page, `short` its name in the list of sections."""

    anchor: str
    title: str
    blocks: Sequence[Block] = ()
    short: str = ""


@dataclass(frozen=True)
class Page:
    """The whole page: title, one sentence under it, a summary line per solver or study, sections."""

    title: str
    lead: str
    sections: Sequence[Section]
    footer: str = ""


def number(value: Any, form: str) -> Markup:
    """One cell: a dash for None, words as they are, a number in format `form` with its full value attached."""
    if value is None:
        return Markup('<span class="none" title="does not apply or was not run">{}</span>').format(DASH)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return escape(value)
    if not math.isfinite(value):
        return Markup('<span class="bad">not finite</span>')
    text = format(value + 0, form).replace("-", "\u2212").replace(",", "\u202f")  # + 0: no minus before zero
    return Markup('<data value="{}">{}</data>').format(json.dumps(value), text)


def cell(row: dict[str, Any], column: Column) -> Markup:
    """A row's cell under a column."""
    return number(row.get(column.key), column.form)


def data_uri(picture: Picture) -> str:
    """The picture as a data: address, so that the page needs no second file."""
    return "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii")


def render(page: Page) -> str:
    """The page as HTML text."""
    environment = Environment(
        loader=PackageLoader("compare"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "data_uri": data_uri}
    environment.globals |= {"cell": cell}
    return environment.get_template("page.html.j2").render(page=page, safe=Markup)


def write(folder: Path, name: str, page: Page, content: dict[str, Any]) -> Path:
    """Write <name>.html and <name>.json into `folder`; returns the page's path.

    Raises ValueError where the content holds a number that JSON cannot say (NaN or infinity).
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    path = folder / f"{name}.html"
    path.write_text(render(page), encoding="utf-8")
    return path
