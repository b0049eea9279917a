"""Run the chapters of the hard cases, judge them, write hard_cases.html and hard_cases.json.

    python -m reports.hard_cases --budget quick|standard|full [--chapter NAME ...]

Every unit runs in a process of its own with one thread, `--jobs` of them at a time. A unit that fails is a
row with the failure's name; nothing else is lost by it.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from compare import gate
from compare.provenance import provenance
from compare.report import Bullets, Commands, Facts, Page, Section, Verdict, write
from compare.verdict import Figure, at_most
from reports import frame
from reports.hard_cases.chapter import Chapter

CHAPTERS: tuple[str, ...] = (
    "elements",
    "grooves",
    "benchmarks",
    "shells",
    "skew",
    "frequencies",
    "motion",
    "rubber",
    "paths",
)
TITLE = "Hard cases"
LEAD = (
    "Published tables, thin, slender, skewed and distorted elements, extreme grooves, nearly incompressible "
    "material, long and violent motion: each case against a value known otherwise, each failure by its name."
)
LIMITS = (
    "That a case between two that pass would pass: each is one shape, one load and one mesh.",
    "That a published value is right to its last digit: its tolerance says what it is trusted to.",
    "That a cross-code case is true: it shows two programs agreeing on one reading of the question.",
    "Anything about times: what a case costs is no case here.",
)


def chapter(name: str) -> ModuleType:
    """The module of a chapter."""
    return importlib.import_module(f"reports.hard_cases.{name}")


def run(
    names: Sequence[str],
    budget: str,
    jobs: int = 2,
    tell: frame.Tell = lambda outcome, done: None,
    take: frame.Take = frame.afresh,
) -> dict[str, Chapter]:
    """Chapters by name. tell: called after each unit with its outcome and the fraction that is done."""
    asked = [(name, unit) for name in names for unit in chapter(name).units(budget)]
    found = frame.outcomes(asked, jobs, take, tell)
    return {name: chapter(name).present(found.get(name, [])) for name in names}


def figures(chapters: dict[str, Chapter]) -> list[Figure]:
    """Every figure of every chapter, and how many cases missed their tolerance or failed."""
    cases = [(name, case) for name, part in chapters.items() for case in part.cases]
    missed = [f"{name}: {case.name} ({case.status})" for name, case in cases if case.met is False]
    judged = sum(case.met is not None for _, case in cases)
    note = f"{judged} of {len(cases)} cases judged. " + (f"Missed: {'; '.join(missed)}." if missed else "None missed.")
    against = "each case's own source and tolerance, printed in its row"
    failed = at_most("benchmarks_failed", "Cases missed or failed", len(missed), "", 0, against=against, note=note)
    return [failed, *(figure for part in chapters.values() for figure in part.figures)]


def rows(chapters: dict[str, Chapter]) -> list[dict[str, object]]:
    """Every case as a row, with its chapter."""
    return [{"chapter": name, **case.row()} for name, part in chapters.items() for case in part.cases]


def gate_rows(chapters: dict[str, Chapter]) -> list[gate.Row]:
    """The cases as the gate knows them."""
    kept = ("solver", "value", "unit", "status")
    return [
        {gate.CASE: f"{row['chapter']}: {row['name']}", "mesh": row["level"]} | {key: row[key] for key in kept}
        for row in rows(chapters)
        if not row["may_fail"]
    ]


def publish(chapters: dict[str, Chapter], budget: str, folder: Path = frame.OUT) -> Path:
    """Write hard_cases.html and hard_cases.json into `folder`; returns the page's path."""
    judged, about = figures(chapters), provenance()
    content = frame.content(judged, budget, rows(chapters), about)
    parts = [Section("verdict", "Verdict", [Verdict(judged)])]
    for name, part in chapters.items():
        parts.append(Section(name, chapter(name).TITLE, [*part.blocks]))
    parts.append(Section("limits", "What a pass does not prove", [Bullets(LIMITS)], "Not proven"))
    again = [("make hard-cases", "this page")]
    again += [(f"python -m reports.hard_cases --chapter {name}", f"{chapter(name).TITLE} alone") for name in chapters]
    parts.append(Section("again", "Every number again", [Commands(again)], "Again"))
    versions = ", ".join(f"{name} {number or 'absent'}" for name, number in about["versions"].items())
    facts = [(key, value) for key, value in about.items() if key != "versions"]
    parts.append(Section("provenance", "Provenance", [Facts([*facts, ("versions", versions)])]))
    return write(folder, "hard_cases", Page(TITLE, LEAD, parts, f"Groovecheck, {about['date']}"), content)


def main(words: Sequence[str] | None = None) -> int:
    """Run, tell, publish; exit status 1 where a judged case was missed or the gate refuses."""
    options = _parser().parse_args(words)
    names = options.chapter or list(CHAPTERS)
    take = frame.taking(options.out, options.fresh)
    chapters = run(names, options.budget, options.jobs, frame.say, take)
    path = publish(chapters, options.budget, options.out)
    frame.print_figures(figures(chapters))
    print(f"page: {path}")
    if (passed := frame.passed("hard_cases", gate_rows(chapters), options)) is not None:
        return int(not passed)
    return int(any(case.met is False for part in chapters.values() for case in part.cases))


def _parser() -> argparse.ArgumentParser:
    parser = frame.gated(frame.parser("hard_cases", LEAD))
    parser.add_argument("--chapter", action="append", choices=CHAPTERS, help="only this chapter (may be repeated)")
    return parser
