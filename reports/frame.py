"""What studies of many units have in common: units in processes, a page with its json, a line per figure.

Every unit runs in a process of its own with one thread and is kept (`reports.keep`), so that a study that was killed
goes on where it was. A unit that fails is a row with the failure's name; nothing else is lost by it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from compare import ci, gate
from compare.provenance import provenance
from compare.report import Commands, Facts, Page, Section, Verdict, write
from compare.scene import BUDGETS
from compare.verdict import Figure
from reports.hard_cases.chapter import Asked, Outcome
from reports.keep import kept, tidy
from reports.unit import Measured, measure

OUT = Path("reports/build")
BASELINES = Path(__file__).parent / "baselines"
Parts = dict[str, list[Outcome]]  # outcomes by the part of the page that they belong to
Take = Callable[[str, dict[str, Any]], Measured]
Tell = Callable[[Outcome, float], None]


def afresh(name: str, arguments: dict[str, Any]) -> Measured:
    """Measure a unit."""
    return measure(name, **arguments)


def taking(folder: Path, fresh: bool) -> Take:
    """How a study that writes into `folder` takes its units: those kept there are read, unless all are to be fresh."""
    return afresh if fresh else partial(kept, tidy(folder / "results" / "units"))


def say(outcome: Outcome, done: float) -> None:
    """A line on the error stream: the fraction that is done, a unit and its status."""
    words = f"{100 * done:5.1f} %  {outcome.asked.name} {outcome.asked.arguments}: {outcome.measured.status}"
    print(words, file=sys.stderr, flush=True)


def outcomes(
    asked: Sequence[tuple[str, Asked]],
    jobs: int,
    take: Take = afresh,
    tell: Tell = say,
) -> Parts:
    """Run units, each under its part, `jobs` at a time. take: measures one, or knows it from before.

    An interrupt starts no other unit; what was measured is kept by `take`.
    """
    found: Parts = {}
    pool = ThreadPoolExecutor(jobs)
    try:
        waiting = [(part, unit, pool.submit(take, unit.name, unit.arguments)) for part, unit in asked]
        for done, (part, unit, future) in enumerate(waiting, 1):
            outcome = Outcome(unit, future.result())
            found.setdefault(part, []).append(outcome)
            tell(outcome, done / len(waiting))
    finally:
        pool.shutdown(cancel_futures=True)
    return found


def content(judged: Sequence[Figure], budget: str, rows: Sequence[dict[str, Any]], about: dict[str, Any]) -> dict:
    """The json of a study."""
    return {
        "figures": {figure.name: figure.entry() for figure in judged},
        "notes": {figure.name: figure.words() for figure in judged},
        "budget": budget,
        "rows": rows,
        "provenance": about,
    }


def publish(name: str, page: ModuleType, found: Parts, budget: str, folder: Path) -> Path:
    """Write <name>.html and <name>.json into `folder`; page: has TITLE, LEAD, figures, rows and sections.

    Returns the page's path.
    """
    judged, about = page.figures(found), provenance()
    again = [(f"make {name.replace('_', '-')}", "this page")]
    again += [(outcome.measured.command, part) for part, own in found.items() for outcome in own]
    facts = [(key, value) for key, value in about.items() if key != "versions"]
    sections = [
        Section("verdict", "Verdict", [Verdict(judged)]),
        *page.sections(found),
        Section("again", "Every number again", [Commands(again)], "Again"),
        Section("provenance", "Provenance", [Facts(facts)]),
    ]
    whole = Page(page.TITLE, page.LEAD, sections, f"Groovecheck, {about['date']}")
    return write(folder, name, whole, content(judged, budget, page.rows(found), about))


def print_figures(judged: Sequence[Figure]) -> None:
    """A line per figure: name, value, unit, whether it met its bar."""
    for figure in judged:
        state = {True: "met", False: "MISSED", None: "not judged"}[figure.met]
        value = "-" if figure.value is None else format(figure.value, figure.form)
        print(f"{figure.name:30} {value:>10} {figure.unit:6} {state}")


def crashed(found: Parts) -> list[Outcome]:
    """The units that raised or were killed, each told on the error stream; a run with a named end did neither."""
    own = [outcome for part in found.values() for outcome in part if outcome.measured.status.startswith("failed")]
    for outcome in own:
        print(f"FAILED  {outcome.measured.command}: {outcome.measured.status}", file=sys.stderr)
    return own


def status(judged: Sequence[Figure], found: Parts, passed: bool | None) -> int:
    """Exit status: 1 where a unit crashed or the gate did not pass; a figure missed its bar, if no gate was asked."""
    missed = any(figure.judged and not figure.met for figure in judged) if passed is None else not passed
    return int(bool(crashed(found)) or missed)


def parser(name: str, lead: str) -> argparse.ArgumentParser:
    """The options that every study of units has."""
    found = argparse.ArgumentParser(prog=f"python -m reports.{name}", description=lead)
    found.add_argument("--budget", choices=BUDGETS, default="standard")
    found.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at a time, one thread each (2)")
    found.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    found.add_argument("--fresh", action="store_true", help="measure everything again, reuse nothing")
    return found


def gated(found: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """The options of a study with accepted rows."""
    found.add_argument("--check", action="store_true", help="compare with the accepted values (budget quick)")
    found.add_argument("--junit", type=Path, metavar="FILE", help="with --check: write the verdict as JUnit XML")
    found.add_argument("--summary", type=Path, metavar="FILE", help="with --check: append the verdict as Markdown")
    found.add_argument("--accept", metavar="REASON", help="make these values the accepted ones (budget quick)")
    return found


def gate_row(name: str, solver: str, value: float | None, unit: str, status: str) -> gate.Row:
    """What the gate knows of a value of a unit; without a value it has not ended well."""
    status = "no value" if value is None and status == "ok" else status
    return {gate.CASE: name, "solver": solver, "value": value, "unit": unit, "status": status}


def gate_rows(found: Parts, gated: dict[str, dict[str, str]], name: Callable[[str, Outcome], str]) -> list[gate.Row]:
    """What the gate knows of units: of each kind of unit its keys with their units. name: of a unit of a part."""
    rows = []
    for part, outcomes in found.items():
        for outcome in outcomes:
            solver, kind = outcome.asked.arguments.get("solver", "ancf"), outcome.asked.name.rpartition(".")[2]
            ended = outcome.get("ended") or outcome.measured.status
            for key, unit in gated.get(kind, {}).items():
                rows.append(gate_row(f"{name(part, outcome)}: {key}", solver, outcome.get(key), unit, ended))
    return rows


def passed(name: str, rows: list[gate.Row], options: argparse.Namespace) -> bool | None:
    """Accept the rows of a study, and compare them with the accepted ones, as far as asked to.

    Whether the gate passes them; None where it was not asked.
    """
    path = BASELINES / f"{name}.json"
    if options.accept:
        gate.accept(rows, options.accept, name, path)
    if not options.check:
        return None
    verdict = gate.check(rows, gate.read(path))
    ci.write(verdict, name, options.junit, options.summary)
    print("\n".join(gate.lines(verdict)))
    return verdict.passed
