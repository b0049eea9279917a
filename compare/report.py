"""Report: tables, figures and pictures as one HTML page that needs no network, and no scripts to be read.

A page is a list of sections, a section a list of blocks; the template draws each kind of block in its
own way. Nothing numeric is computed here: numbers are formatted, and each one on the page carries its
full value as <data value="...">, the same double that the JSON beside the page holds.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from compare.bodies import Body
from compare.figures import Picture
from compare.files import write_text
from compare.verdict import Figure

DASH = "–"
SCRIPTS = ("start.js", "tables.js", "plots.js")
VIEWER = ("scene3d.js", "viewer.js")


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

    form: a format of numbers, "text" for words on one line, "wrap" for words on several, "tag" for a verdict,
    "link" for a Link.
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
        return {"text": "text", "tag": "text", "wrap": "wrap", "link": "wrap"}.get(self.form, "num")


@dataclass(frozen=True)
class Link:
    """A cell that opens another page: address, percent-encoded, and its words."""

    href: str
    text: str


@dataclass(frozen=True)
class Table:
    """Rows under columns. `notes` are printed below it; a row's "status" other than "ok" marks the row.

    A row whose "run" names one of the page's bodies opens it in three dimensions.
    """

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


@dataclass(frozen=True)
class Bodies:
    """Surfaces that rows of the page's tables open in three dimensions; left_out: why others are not here."""

    kind: ClassVar[str] = "bodies"
    items: Sequence[Body]
    left_out: str = ""


Block = Text | Bullets | Commands | Table | Verdict | Plots | Gallery | Facts | Bodies


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
    value = row.get(column.key)
    if isinstance(value, Link):
        return Markup('<a href="{}">{}</a>').format(value.href, value.text)
    if column.form == "tag":
        look = value if value in ("met", "missed") else "idle"
        return Markup('<span class="tag {}">{}</span>').format(look, value)
    return number(value, column.form)


def minus(words: Any) -> str:
    """Words with a typographic minus before numbers."""
    return re.sub(r"(?<![\w.])-(?=\d)", "\u2212", str(words))


def data_uri(picture: Picture) -> str:
    """The picture as a data: address, so that the page needs no second file."""
    return "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii")


def render(page: Page) -> str:
    """The page as HTML text. Its policy lets run the scripts of this package alone, known by their hash."""
    environment = Environment(
        loader=PackageLoader("compare"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "data_uri": data_uri, "minus": minus}
    environment.globals |= {"cell": cell}
    text = script(any(block.kind == "bodies" for section in page.sections for block in section.blocks))
    digest = base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")
    drawn = environment.get_template("page.html.j2")
    return drawn.render(page=page, safe=Markup, script=Markup(text), digest=digest)


def script(bodies: bool) -> str:
    """The scripts of a page; the viewer only where there are bodies to view."""
    folder = Path(__file__).parent / "templates"
    names = (*SCRIPTS, *(VIEWER if bodies else ()))
    return "\n" + "\n".join((folder / name).read_text(encoding="utf-8") for name in names)


def write(folder: Path, name: str, page: Page, content: dict[str, Any]) -> Path:
    """Write <name>.html and <name>.json into `folder`, extend its history and its index; returns the page's path.

    Raises ValueError where the content holds a number that JSON cannot say (NaN or infinity).
    """
    from compare import history, index, trend

    folder.mkdir(parents=True, exist_ok=True)
    content = {"title": page.title, **content}
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)
    history.append(folder, history.record(name, content))
    page = _with(page, trend.section(history.read(folder, name)))
    path = folder / f"{name}.html"
    write_text(path, render(page))
    write_text(folder / f"{name}.json", text + "\n")
    index.write(folder)
    return path


def _with(page: Page, section: Section | None) -> Page:
    """The page with a section before its last one, which is the provenance."""
    if section is None:
        return page
    return replace(page, sections=[*page.sections[:-1], section, *page.sections[-1:]])
