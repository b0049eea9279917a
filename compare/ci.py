"""A gate's verdict for build servers: JUnit XML, which they list test by test, and a Markdown summary."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from compare.files import write_text
from compare.gate import Margin, Verdict, lines

FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0


def junit(verdict: Verdict, name: str) -> str:
    """JUnit XML of a verdict: one test case per row, a failure with its numbers where the gate refuses it."""
    refused = sum(margin.refused for margin in verdict.margins)
    suite = ElementTree.Element(
        "testsuite",
        name=_clean(f"groovecheck {name}"),
        tests=str(len(verdict.margins)),
        failures=str(refused),
        errors="0",
    )
    for margin in verdict.margins:
        case = ElementTree.SubElement(suite, "testcase", classname=_clean(name), name=_clean(margin.row))
        if margin.refused:
            failure = ElementTree.SubElement(case, "failure", type=margin.verdict, message=_clean(_short(margin)))
            failure.text = _clean(_line(margin, verdict))
        elif margin.used is not None:
            ElementTree.SubElement(case, "system-out").text = _clean(_line(margin, verdict))
    ElementTree.indent(suite)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(suite, encoding="unicode") + "\n"


def markdown(verdict: Verdict, name: str) -> str:
    """A summary as Markdown: refused rows as a table, then the rows nearest to their tolerance."""
    refused = [margin for margin in verdict.margins if margin.refused]
    word = "passes" if verdict.passed else "refuses"
    count = f"{len(verdict.margins)} rows" if verdict.passed else f"{len(refused)} of {len(verdict.margins)} rows"
    near = sorted((m for m in verdict.margins if m.used is not None and not m.refused), key=lambda m: -m.used)[:5]
    said = [f"### groovecheck: {_cell(name)}: the gate {word} {count}", ""]
    said += ["| row | verdict | value | accepted | part of tolerance |", "|---|---|---:|---:|---:|"]
    said += [_row(margin) for margin in (*refused, *near)]
    return "\n".join([*said, "", lines(verdict)[-1] + ".", ""])


def write(verdict: Verdict, name: str, xml: Path | None, summary: Path | None) -> None:
    """Write the JUnit file, and append the summary to its file, as a build server's step summary wants it."""
    if xml is not None:
        write_text(xml, junit(verdict, name))
    if summary is not None:
        summary.parent.mkdir(parents=True, exist_ok=True)
        with summary.open("a", encoding="utf-8") as file:
            file.write(markdown(verdict, name))


def _row(margin: Margin) -> str:
    numbers = ["–" if value is None else f"{value:.6g} {margin.unit}" for value in (margin.value, margin.accepted)]
    part = "–" if margin.used is None else f"{100 * margin.used:.3g} %"
    word = f"**{margin.verdict}**" if margin.refused else margin.verdict
    return f"| {_cell(margin.row)} | {word} | {' | '.join(numbers)} | {part} |"


def _cell(text: str) -> str:
    """Words that stay words in a cell of a Markdown table."""
    text = " ".join(text.split())
    return re.sub(r"([|\\`*_<>\[\]])", r"\\\1", text)


def _short(margin: Margin) -> str:
    return margin.status if margin.verdict in ("failed", "missing") else f"{100 * margin.used:.3g} % of its tolerance"


def _line(margin: Margin, verdict: Verdict) -> str:
    return "\n".join(lines(Verdict((margin,), verdict.tolerance, verdict.same_platform, verdict.differs)))


def _clean(text: str) -> str:
    return FORBIDDEN.sub("\ufffd", text)
