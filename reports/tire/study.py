"""Drop the tire, judge it, write tire.html and tire.json.

    python -m reports.tire --budget quick|standard|full

Every unit runs in a process of its own with one thread, `--jobs` of them at a time. A unit that fails is a row
with the failure's name; nothing else is lost by it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from compare.provenance import provenance
from compare.report import Commands, Facts, Page, Section, Verdict, write
from compare.scene import BUDGETS
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import page
from reports.unit import measure

OUT = Path("reports/build")
RUNS = "tire.runs"
UNTIL = 0.32  # s: the first bounce
EVEN = {  # elements of the quarter
    "quick": ([6, 3], [12, 5]),
    "standard": ([6, 3], [8, 4], [12, 5], [16, 8]),
    "full": ([6, 3], [8, 4], [12, 5], [16, 8], [24, 10]),
}
FITTED = {"quick": ([12, 4],), "standard": ([8, 3], [12, 4], [16, 8]), "full": ([8, 3], [12, 4], [16, 8], [24, 10])}
SIZES = {"quick": (0.4, 0.3, 0.22), "standard": (0.3, 0.22, 0.16), "full": (0.3, 0.22, 0.16, 0.13)}
PAPER = {"element": "conforming", "volumetric": "reduced", "points": [4, 4, 3]}
LONG = {"quick": [], "standard": [6, 3], "full": [12, 5]}


def units(budget: str) -> list[tuple[str, Asked]]:
    """What is run, each under the part of the page that it belongs to; the dearest first."""
    found = [("drop", _drop(solver="reference", size=size)) for size in reversed(SIZES[budget])]
    found += [("drop", _drop(mesh=mesh)) for mesh in EVEN[budget]]
    found += [("drop", _drop(mesh=mesh, fit=page.FIT)) for mesh in FITTED[budget]]
    if LONG[budget]:
        found.append(("long", Asked(f"{RUNS}.drop", {"mesh": LONG[budget], "until": 2.0})))
    if budget != "quick":
        found += [("paper", _drop(mesh=mesh, **PAPER)) for mesh in ([6, 3], [12, 5])]
        found += [("points", _drop(mesh=mesh, law="points")) for mesh in ([6, 3], [12, 5])]
        found.append(("print", Asked(f"{RUNS}.footprint", {"solver": "reference", "size": SIZES[budget][-2]})))
    found.append(
        ("print", Asked(f"{RUNS}.footprint", {"mesh": FITTED[budget][-1], "fit": page.FIT, "points": [7, 5, 3]}))
    )
    found += [("saved", Asked(f"{RUNS}.part", {"mesh": [6, 3], "part": part})) for part in ("quarter", "half", "whole")]
    found += [("pressed", asked) for asked in _pressed(budget)]
    found += [("hard", asked) for asked in _hard(budget)]
    found.append(("rubber", Asked(f"{RUNS}.rubber", {"mesh": [12, 5]})))
    return found


def _drop(**arguments: Any) -> Asked:
    return Asked(f"{RUNS}.drop", {**arguments, "until": UNTIL})


def _pressed(budget: str) -> Iterator[Asked]:
    """Load-deflection curves with and without inflation, and one point of them by the solid."""
    for inflation in (0.0, page.INFLATION):
        for deflection in (0.01, 0.02, page.DEFLECTION, 0.06):
            told = {"deflection": deflection, "inflation": inflation, "mesh": page.LINED, "fit": page.FIT}
            yield Asked(f"{RUNS}.pressed", told)
    for size in SIZES[budget][:3]:
        told = {"deflection": page.DEFLECTION, "inflation": page.INFLATION, "solver": "reference", "size": size}
        yield Asked(f"{RUNS}.pressed", told)


def _hard(budget: str) -> Iterator[Asked]:
    """Item by item what is far from the scene; on the coarsest mesh, 12 x 6 of the whole tire."""
    cases: list[dict[str, Any]] = [{"bulk": 1e4 * 4.5e6 / 1.33e8}, {"height": 0.2}, {"stiffness": 100.0}]
    cases += [{"depth": 0.09}, {"time_step": 4e-3}, {"time_step": 2e-3, "integrator": "generalized-alpha"}]
    if budget != "quick":
        cases += [{"time_step": 4e-4}]
    if budget == "full":
        cases += [{"time_step": 4e-5}]
    for case in cases:
        yield Asked(f"{RUNS}.drop", {"mesh": [6, 3], **case, "until": UNTIL})


def run(budget: str, jobs: int) -> dict[str, list[Outcome]]:
    """Outcomes by part of the page."""
    asked, found = units(budget), {}
    with ThreadPoolExecutor(jobs) as pool:
        waiting = [(part, unit, pool.submit(measure, unit.name, **unit.arguments)) for part, unit in asked]
        for done, (part, unit, future) in enumerate(waiting, 1):
            outcome = Outcome(unit, future.result())
            found.setdefault(part, []).append(outcome)
            words = f"{100 * done / len(waiting):5.1f} %  {unit.name} {unit.arguments}: {outcome.measured.status}"
            print(words, file=sys.stderr, flush=True)
    return found


def publish(found: dict[str, list[Outcome]], budget: str, folder: Path = OUT) -> Path:
    """Write tire.html and tire.json into `folder`; returns the page's path."""
    judged, about = page.figures(found), provenance()
    content = {
        "figures": {figure.name: figure.entry() for figure in judged},
        "notes": {figure.name: figure.words() for figure in judged},
        "budget": budget,
        "rows": page.rows(found),
        "provenance": about,
    }
    again = [("make tire", "this page")]
    again += [(outcome.measured.command, part) for part, outcomes in found.items() for outcome in outcomes]
    facts = [(key, value) for key, value in about.items() if key != "versions"]
    sections = [
        Section("verdict", "Verdict", [Verdict(judged)]),
        *page.sections(found),
        Section("again", "Every number again", [Commands(again)], "Again"),
        Section("provenance", "Provenance", [Facts(facts)]),
    ]
    return write(folder, "tire", Page(page.TITLE, page.LEAD, sections, f"Groovecheck, {about['date']}"), content)


def main(words: Sequence[str] | None = None) -> int:
    """Run, tell, publish; exit status 1 where a figure missed its bar."""
    options = _parser().parse_args(words)
    found = run(options.budget, options.jobs)
    path = publish(found, options.budget, options.out)
    judged = page.figures(found)
    for figure in judged:
        state = {True: "met", False: "MISSED", None: "not judged"}[figure.met]
        value = "-" if figure.value is None else format(figure.value, figure.form)
        print(f"{figure.name:30} {value:>10} {figure.unit:6} {state}")
    print(f"page: {path}")
    return int(any(figure.met is False for figure in judged))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m reports.tire", description=page.LEAD)
    parser.add_argument("--budget", choices=BUDGETS, default="standard")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at a time, one thread each (2)")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    return parser
