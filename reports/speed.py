"""The speed exhibit: what both solvers cost, alone, against each other and against codes that are installed.

    python -m reports.speed --budget quick|standard|full

runs every unit in a fresh process with one thread, one after the other, and writes speed.html and speed.json.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from compare.provenance import provenance
from compare.report import write
from reports.speed_curves import Curves
from reports.speed_figures import figures
from reports.speed_page import page
from reports.speed_runs import ENOUGH
from reports.unit import Measured, command, measure, measurements

OUT = Path("reports/build")
UNKNOWNS, MANY = 5532, 100_000  # of the reference's two judged meshes
OWN = [[2, 2], [3, 2], [3, 3], [4, 4]]  # meshes to choose from
CLOSER = {"conforming": [8, 12], "enriched": [2, 3], "sizes": [0.3, 0.2]}  # 1 % is between them
TABLE5 = [2, 3, 4, 5, 6, 8, 12, 16]

# What each budget pays for; None leaves a unit out. runs: time step (s) by mesh.
BUDGETS: dict[str, dict[str, Any]] = {
    "quick": {
        "kernel_seconds": 1.0,
        "growth": [16, 64],
        "runs": {8: 0.005, 16: 0.005},
        "table5": None,
        "reference_runs": 1,
        "calculix_until": 0.04,
        "many": None,
        "curve": {"conforming": [2, 4, 8, 12], "enriched": [2, 3, 4], "sizes": [0.3, 0.2, 0.14]},
        "curve_calculix": [],
        "own_steps": None,
        "exudyn": None,
    },
    "standard": {
        "kernel_seconds": 6.0,
        "growth": [16, 64, 316],
        "runs": {8: 0.005, 16: 0.005, 32: 0.02},
        "table5": TABLE5,
        "reference_runs": 2,
        "calculix_until": 1.0,
        "many": MANY,
        "curve": {
            "conforming": [2, 4, 8, 12, 16, 24],
            "enriched": [1, 2, 3, 4, 6, 8, 12],
            "sizes": [0.5, 0.3, 0.2, 0.14, 0.1],
            "closer": CLOSER,
        },
        "curve_calculix": [0.5, 0.3, 0.2],
        "own_steps": {"enriched": OWN, "sizes": [0.3, 0.25, 0.2], "time_steps": [0.02, 0.05, 0.1]},
        "exudyn": {"mesh": 16, "steps": 100},
    },
    "full": {
        "kernel_seconds": 12.0,
        "growth": [16, 32, 64, 128, 316],
        "runs": {8: 0.005, 16: 0.005, 32: 0.02, 64: 0.02},
        "table5": TABLE5,
        "reference_runs": 3,
        "calculix_until": 1.0,
        "many": MANY,
        "curve": {
            "conforming": [2, 4, 8, 12, 16, 24, 32, 48],
            "enriched": [1, 2, 3, 4, 6, 8, 12, 16, 24],
            "sizes": [0.5, 0.3, 0.2, 0.14, 0.1, 0.07, 0.05],
            "closer": CLOSER,
        },
        "curve_calculix": [0.5, 0.3, 0.2, 0.14],
        "own_steps": {"enriched": OWN, "sizes": [0.3, 0.25, 0.2], "time_steps": [0.02, 0.05, 0.1]},
        "exudyn": {"mesh": 16, "steps": 100},
    },
}

Report = Callable[[Measured, float], None]
Found = dict[str, Any]


def gather(budget: str, tell: Report = lambda measured, seconds: None) -> Found:
    """Everything a budget pays for, by name; lists hold the repetitions or sizes of one unit.

    "load": processes that wanted the machine in the minute before.
    """
    plan = BUDGETS[budget]

    def take(name: str, **arguments: Any) -> Measured:
        begin = time.perf_counter()
        measured = measure(name, **arguments)
        tell(measured, time.perf_counter() - begin)
        return measured

    found: Found = {"load": os.getloadavg()[0]}
    found["kernels"] = take("speed_kernels.kernels", mesh=16, seconds=plan["kernel_seconds"])
    found["growth"] = [take("speed_kernels.growth", mesh=n, seconds=plan["kernel_seconds"] / 8) for n in plan["growth"]]
    found["rubber"] = take("speed_rubber.kernels", seconds=plan["kernel_seconds"])
    found["ancf"] = [
        take("speed_runs.ancf", scene="cantilever_plain", mesh=n, time_step=step, repeats=3 if n <= 16 else 1)
        for n, step in plan["runs"].items()
    ]
    found["table5"] = plan["table5"] and take("speed_runs.table5", meshes=plan["table5"])
    found |= _against_calculix(take, plan)
    found["exudyn"] = plan["exudyn"] and take("speed_runs.exudyn_run", **plan["exudyn"])
    if plan["exudyn"]:
        mesh, steps = plan["exudyn"]["mesh"], plan["exudyn"]["steps"]
        found["exudyn_ours"] = take("speed_runs.ancf", scene="cantilever_plain", mesh=mesh, time_step=1 / steps)
    found["many"] = _many(take, plan)
    found["curve"] = take("speed_runs.curve", **plan["curve"])
    patch = {"time_step": 0.02, "scene": "cantilever_plain_patch"}
    found["curve_calculix"] = [take("speed_runs.calculix_run", size=size, **patch) for size in plan["curve_calculix"]]
    ours, solid = (Curves.of(found["curve"]).first(series, 1.0) for series in ("enriched", "reference"))
    found["one_percent"] = []
    if ours and solid:
        found["one_percent"] = [
            take("speed_runs.ancf", mesh=round(1 / ours["h"]), element="enriched", repeats=5, points=ENOUGH, **patch),
            take("speed_runs.reference", size=solid["h"], repeats=2, **patch),
        ]
    found["own_steps"] = plan["own_steps"] and take("speed_runs.own_steps", **plan["own_steps"])
    return found


def _against_calculix(take: Callable[..., Measured], plan: dict[str, Any]) -> Found:
    """The reference and CalculiX on one mesh, alternating."""
    size = take("speed_runs.size", unknowns=UNKNOWNS)
    if not size.ok:
        return {"reference": [size], "calculix": []}
    same = {"size": size.get("size"), "time_step": 0.01, "until": plan["calculix_until"]}
    ours, theirs = [], []
    for k in range(plan["reference_runs"]):
        ours.append(take("speed_runs.reference", scene="cantilever_plain", **same))
        if k == 0 or (plan["reference_runs"] > 2 and k == 1):
            theirs.append(take("speed_runs.calculix_run", **same))
    return {"reference": ours, "calculix": theirs}


def _many(take: Callable[..., Measured], plan: dict[str, Any]) -> Measured | None:
    """The reference on its large mesh."""
    if plan["many"] is None:
        return None
    size = take("speed_runs.size", unknowns=plan["many"])
    return take("speed_runs.newton", size=size.get("size"), steps=20, time_step=0.02) if size.ok else size


def publish(found: Found, budget: str, folder: Path = OUT) -> Path:
    """Write speed.html and speed.json into `folder`; returns the page's path."""
    judged, about = figures(found), provenance()
    curves = Curves.of(found["curve"], found["curve_calculix"])
    content = {
        "figures": {figure.name: figure.entry() for figure in judged},
        "notes": {figure.name: figure.words() for figure in judged},
        "budget": budget,
        "measured": {name: _plain(value) for name, value in found.items()},
        "costs": curves.costs(),
        "provenance": about,
    }
    return write(folder, "speed", page(found, judged, curves, budget, about), content)


def _plain(value: Any) -> Any:
    """A measurement as JSON values."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, Measured):
        return {"status": value.status, "command": command(value.name, value.arguments), **value.values}
    return value


def main(words: Sequence[str] | None = None) -> int:
    """Measure, tell, publish; exit status 1 where a unit failed. A missed bar is told, not punished: times vary."""
    parser = argparse.ArgumentParser(prog="python -m reports.speed", description="Measure what both solvers cost.")
    parser.add_argument("--budget", choices=BUDGETS, default="standard")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    options = parser.parse_args(words)

    def tell(measured: Measured, seconds: float) -> None:
        print(f"{seconds:7.1f} s  {measured.name} {measured.arguments}: {measured.status}", file=sys.stderr, flush=True)

    found = gather(options.budget, tell)
    path = publish(found, options.budget, options.out)
    for figure in figures(found):
        state = {True: "met", False: "MISSED", None: "not judged"}[figure.met]
        value = "-" if figure.value is None else format(figure.value, figure.form)
        bar = "" if figure.bar is None else f"{'at least' if figure.least else 'at most'} {figure.bar:g}"
        print(f"{figure.name:30} {value:>6} {figure.unit:6} {bar:14} {state}")
    print(f"page: {path}")
    return int(any(run.status.startswith("failed") for run in measurements(found)))


if __name__ == "__main__":
    sys.exit(main())
