"""Drop the tire, judge it, write tire.html and tire.json.

    python -m reports.tire --budget quick|standard|full
    python -m reports.tire --budget full --record REASON

Every unit runs in a process of its own with one thread, `--jobs` of them at a time. A unit that fails is a row
with the failure's name; nothing else is lost by it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from compare import gate
from reports import frame
from reports.hard_cases.chapter import Asked
from reports.tire import kernels, limits, page, recorded, rolling, savings, standing, treads

RUNS = "tire.runs"
UNTIL = 0.32  # s: the first bounce
EVEN = {  # elements of the quarter
    "quick": ([6, 3], [12, 5]),
    "standard": ([6, 3], [8, 4], [12, 5], [16, 8]),
    "full": ([6, 3], [8, 4], [12, 5], [16, 8], [24, 10]),
}
SIZES = {"quick": (0.4, 0.3, 0.22), "standard": (0.22, 0.16, 0.11), "full": (0.22, 0.16, 0.11, 0.08, 0.062)}
PRINTS = {"standard": 0.16, "full": 0.11}  # m: the solid whose footprint is drawn
SMOOTH = {"walls": False, "lips": False}  # elements without kinks, for comparison
PAPER = {"element": "conforming", "volumetric": "reduced", "points": [4, 4, 3], **SMOOTH}
LONG = {"quick": [], "standard": [6, 3], "full": [12, 5]}


def units(budget: str) -> list[tuple[str, Asked]]:
    """What is run, each under the part of the page that it belongs to; the dearest first."""
    found = [("drop", _drop(solver="reference", size=size)) for size in reversed(SIZES[budget])]
    found += [("drop", _drop(mesh=mesh)) for mesh in EVEN[budget]]
    found.append(("off knots", _drop(mesh=page.OFF_KNOTS)))
    found += [("smooth", _drop(mesh=mesh, **SMOOTH)) for mesh in EVEN[budget]]
    if LONG[budget]:
        found.append(("long", Asked(f"{RUNS}.drop", {"mesh": LONG[budget], "until": 2.0})))
    if budget != "quick":
        found += [("paper", _drop(mesh=mesh, **PAPER)) for mesh in ([6, 3], [12, 5])]
        found += [("points", _drop(mesh=mesh, law="points")) for mesh in ([6, 3], [12, 5])]
        found.append(("print", Asked(f"{RUNS}.footprint", {"solver": "reference", "size": PRINTS[budget]})))
    found.append(("print", Asked(f"{RUNS}.footprint", {"mesh": page.MESH, "points": [8, 5, 3]})))
    found += [("saved", Asked(f"{RUNS}.part", {"mesh": [6, 3], "part": part})) for part in ("quarter", "half", "whole")]
    found += [("rolling", asked) for asked in rolling.units(budget)]
    found += [("omitted", asked) for asked in savings.units()]
    found += [("treads", asked) for asked in treads.units(budget)]
    found += [("standing", asked) for asked in standing.units(budget)]
    found += [("hard", asked) for asked in _hard(budget)]
    found += [("kernels", asked) for asked in kernels.units()]
    found += [("misfit", Asked(f"{RUNS}.misfit", {"mesh": mesh})) for mesh in (*EVEN[budget], page.OFF_KNOTS)]
    return found


def _drop(**arguments: Any) -> Asked:
    return Asked(f"{RUNS}.drop", {**arguments, "until": UNTIL})


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


def run(budget: str, jobs: int, take: frame.Take = frame.afresh) -> frame.Parts:
    """Outcomes by part of the page."""
    return frame.outcomes(units(budget), jobs, take)


GATED = {
    "drop": {"travel": "m", "peak_force": "N", "lowest_ratio": ""},
    "part": {"node_1": "m"},
    "standing": {"radius": "m", "stiffness": "N/m"},
}


def gate_rows(found: frame.Parts) -> list[gate.Row]:
    """What the gate knows of the falls, hard ones too, of the parts of a tire and of the standing one."""
    return frame.gate_rows(found, GATED, lambda part, outcome: f"{part}: {page.case(outcome)}")


def publish(found: frame.Parts, budget: str, folder: Path = frame.OUT) -> Path:
    """Write tire.html and tire.json into `folder`; returns the page's path."""
    return frame.publish("tire", page, found, budget, folder)


def _recorded(found: frame.Parts, reason: str) -> bool:
    """Whether all solids of a full study are recorded; else nothing is, and the error stream tells why."""
    sizes = tuple(o.get("h") for o in limits.ladder(found["drop"], "reference").outcomes)
    try:
        if sizes != SIZES["full"]:
            raise ValueError(f"the solids that ended well are of {sizes} m")
        recorded.write(found["drop"], reason)
    except ValueError as error:
        print(f"not recorded: {error}", file=sys.stderr)
        return False
    return True


def main(words: Sequence[str] | None = None) -> int:
    """Run, tell, publish; exit status 1 where a figure missed its bar, or has no value because a unit failed."""
    parser = frame.gated(frame.parser("tire", page.LEAD))
    parser.add_argument("--record", metavar="REASON", help="keep these solids for shorter studies (budget full)")
    options = parser.parse_args(words)
    if options.record is not None and (options.budget != "full" or not options.record.strip()):
        parser.error("--record: states a reason, and records the solids of --budget full alone")
    found = run(options.budget, options.jobs, frame.taking(options.out, options.fresh))
    path = publish(found, options.budget, options.out)
    if options.record and not _recorded(found, options.record):
        return 1
    judged = page.figures(found)
    frame.print_figures(judged)
    print(f"page: {path}")
    return frame.status(judged, found, frame.passed("tire", gate_rows(found), options))
