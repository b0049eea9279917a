"""Run the plate drop, judge it, write plate_drop.html and plate_drop.json.

    python -m reports.plate_drop --budget quick|standard|full

Every unit runs in a process of its own with one thread, `--jobs` of them at a time. A unit that fails is a row
with the failure's name; nothing else is lost by it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from compare import gate
from reports import frame
from reports.hard_cases.chapter import Asked, Outcome
from reports.plate_drop import page

PAPER = {"element": "conforming", "mesh": [1, 1], "points": [7, 3, 3]}
STEP = {"quick": 5e-3, "standard": 2.5e-3, "full": 2.5e-3}
TWO = [[0.2, 0.3], [0.7, 0.8]]
ENRICHED = {
    "quick": ({"mesh": [2, 2]}, {"mesh": [4, 4]}),
    "standard": ({"mesh": [2, 2]}, {"mesh": [4, 4]}, {"mesh": [2, 1], "fit": [0.8]}, {"mesh": [2, 8]}),
    "full": ({"mesh": [2, 2]}, {"mesh": [4, 4]}, {"mesh": [2, 1], "fit": [0.8]}, {"mesh": [2, 8]}, {"mesh": [8, 8]}),
}
SOLID = {"quick": (0.1,), "standard": (0.2, 0.1), "full": (0.2, 0.1, 0.07)}
STIFFNESSES = (1e-2, 1.0, 1e2, 1e4)
STEPS = {"quick": (1e-2, 1e-3), "standard": (1e-2, 1e-3, 1e-4), "full": (1e-2, 1e-3, 1e-4, 1e-5)}
HARD = "plate_drop.hard"
RUNS = "plate_drop.runs"


def units(budget: str) -> list[tuple[str, Asked]]:
    """What is run, each under the part of the page that it belongs to."""
    step = {"time_step": STEP[budget]}
    found = [
        ("grooves", Asked(f"{RUNS}.fall", {"law": "points", "mesh": [2, 2], "grooves": TWO, **_rest(PAPER), **step}))
    ]
    for law in ("points", "pressure"):
        for count in (2, 3, 4, 5):
            own = PAPER | {"points": [7, count, 3]}
            found.append(("points", Asked(f"{RUNS}.fall", {"law": law, **own, **step})))
    found += [("subdomains", Asked(f"{RUNS}.fall", {"law": "pressure", **own, **step})) for own in _divisions()]
    found += [("compared", asked) for asked in _compared(budget, step)]
    found += [("sensitivity", asked) for asked in _sensitivity(budget, step)]
    found += [("hard", asked) for asked in _hard(budget)]
    found.append(("detail", Asked(f"{RUNS}.detail", {"counts": [1, 2, 4], "mesh": [1, 1]})))
    return found


def _rest(level: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in level.items() if key != "mesh"}


def _divisions() -> Iterator[dict[str, Any]]:
    """One subdomain (the global rule, with as many points as three have), three, and four: the groove in halves."""
    yield PAPER | {"integration": "global", "points": [7, 9, 3]}
    yield PAPER
    yield PAPER | {"grooves": [[0.4, 0.5], [0.5, 0.6]]}


def _compared(budget: str, step: dict[str, float]) -> Iterator[Asked]:
    for own in ENRICHED[budget]:
        yield Asked(f"{RUNS}.fall", {"law": "pressure", "element": "enriched", "points": [7, 7, 3], **own, **step})
        yield Asked(f"{RUNS}.rest", {"law": "pressure", "element": "enriched", "points": [7, 7, 3], **own})
    for size in SOLID[budget]:
        yield Asked(f"{RUNS}.fall", {"law": "pressure", "solver": "reference", "size": size, "time_step": 5e-3})
        yield Asked(f"{RUNS}.rest", {"law": "pressure", "solver": "reference", "size": size})


def _sensitivity(budget: str, step: dict[str, float]) -> Iterator[Asked]:
    heights, depths = ((0.02, 0.08), (0.02,)) if budget == "quick" else ((0.01, 0.02, 0.08, 0.16), (0.01, 0.02, 0.04))
    varied = [{"height": height} | step for height in heights] + [{"depth": depth} | step for depth in depths]
    varied += [{"time_step": dt} for dt in (2.5e-3, 1.25e-3, 6.25e-4) if dt < STEP[budget] and budget != "quick"]
    varied += [{"integrator": name} | step for name in ("trapezoidal", "generalized-alpha")]
    for own in varied:
        yield Asked(f"{RUNS}.fall", {"law": "points", **PAPER, **own})


def _hard(budget: str) -> Iterator[Asked]:
    for stiffness in STIFFNESSES:
        for step in STEPS[budget]:
            yield Asked(f"{HARD}.landing", {"stiffness": stiffness, "step": step})
    for step in STEPS[budget][:2]:
        yield Asked(f"{HARD}.landing", {"stiffness": 1e4, "step": step, "integrator": "trapezoidal"})
    yield from (Asked(f"{HARD}.{name}") for name in ("stopping", "edge_on", "resting"))


def run(budget: str, jobs: int, take: frame.Take = frame.afresh) -> frame.Parts:
    """Outcomes by part of the page."""
    return frame.outcomes(units(budget), jobs, take)


GATED = {
    "fall": {"lowest": "m", "rebound": "m", "peak_force": "N"},
    "rest": {"sunk": "m", "reaction": ""},
    "landing": {"peak_force": "N"},
    "stopping": {"value": "m"},
    "edge_on": {"pressed": "m2"},
    "resting": {"sunk": "m"},
}


def gate_rows(found: frame.Parts) -> list[gate.Row]:
    """What the gate knows of each run that may not fail.

    Another BLAS rounds otherwise, and contact points might open and stick at other moments: with OpenBLAS's oldest
    kernels no row moves by more than 2.5e-10, so that the gate's 1e-6 on one platform and 1e-4 between two have room.
    """
    kept = {part: [o for o in outcomes if not page.may_fail(o.asked)] for part, outcomes in found.items()}
    return frame.gate_rows(kept, GATED, _named)


def _named(part: str, outcome: Outcome) -> str:
    words = [f"{key} {value}" for key, value in outcome.asked.arguments.items() if key != "solver"]
    kind = outcome.asked.name.rpartition(".")[2]
    return ", ".join([f"{part}: {kind}", *words]).translate(str.maketrans("", "", "[]'"))


def publish(found: frame.Parts, budget: str, folder: Path = frame.OUT) -> Path:
    """Write plate_drop.html and plate_drop.json into `folder`; returns the page's path."""
    return frame.publish("plate_drop", page, found, budget, folder)


def main(words: Sequence[str] | None = None) -> int:
    """Run, tell, publish; exit status 1 where a figure missed its bar, or has no value because a unit failed."""
    options = frame.gated(frame.parser("plate_drop", page.LEAD)).parse_args(words)
    found = run(options.budget, options.jobs, frame.taking(options.out, options.fresh))
    path = publish(found, options.budget, options.out)
    judged = page.figures(found)
    frame.print_figures(judged)
    print(f"page: {path}")
    return frame.status(judged, found, frame.passed("plate_drop", gate_rows(found), options))
