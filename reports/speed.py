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
from compare.verdict import Figure, at_least, at_most, stated
from reports.speed_curves import Curves
from reports.speed_page import page
from reports.unit import Measured, command, measure, measurements

OUT = Path("reports/build")
UNKNOWNS, MANY = 5532, 100_000  # of the reference's two judged meshes
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
        "curve": {"meshes": [2, 4, 8, 12], "sizes": [0.5, 0.3, 0.2]},
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
        "curve": {"meshes": [2, 4, 8, 12, 16, 24], "sizes": [0.5, 0.3, 0.2, 0.14, 0.1]},
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
        "curve": {"meshes": [2, 4, 8, 12, 16, 24, 32, 48], "sizes": [0.5, 0.3, 0.2, 0.14, 0.1, 0.07, 0.05]},
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


def figures(found: Found) -> list[Figure]:
    """Every number that the exhibit is judged by, each with the command that measures it again in its note."""
    return [
        *_kernel_figures(found["kernels"], found["growth"]),
        *_run_figures(found),
        *_reference_figures(found),
        *_cost_figures(found),
    ]


def _kernel_figures(kernels: Measured, growth: Sequence[Measured]) -> list[Figure]:
    rows = {row["plate"]: row for row in kernels.get("rows") or []}
    plain = rows.get("plain", {})
    grooves = [rows[name] for name in ("plain", "one groove", "five grooves") if name in rows]
    worst = {what: max((row[f"{what}_us"] for row in grooves), default=None) for what in ("force", "tangent")}
    words = "Dearest of plain, one groove and five grooves on 16x16 elements, element arrays alone, CPU time."
    note = _note(kernels, f"{words} With the sums into the global matrix: {_us(plain, 'assembled_tangent')} plain.")
    against = "cross-code: Chrono's C++ plate with the same coordinates takes 35 to 47 (tangent) and 2.7 to 5 (force)"
    ratio = (
        "Dearer of one and five grooves over plain, 256 elements, median over rounds in which all have their turn. "
        + _grown(growth)
    )
    return [
        at_most("tangent_us", "Tangent of an ANCF element", worst["tangent"], "µs", 15, against=against, note=note),
        at_most("force_us", "Internal force of an ANCF element", worst["force"], "µs", 3, against=against, note=note),
        at_most(
            "tangent_groove_ratio",
            "Tangent with grooves over tangent without",
            kernels.get("tangent_groove_ratio"),
            "",
            1.1,
            against="the plain plate in the same process",
            note=_note(kernels, ratio),
        ),
    ]


def _grown(growth: Sequence[Measured]) -> str:
    """The ratio of five grooves over plain on the larger plates, in words."""
    words = []
    for run in growth:
        ratio = {row["plate"]: row.get("tangent_ratio") for row in run.get("rows") or []}.get("five grooves")
        if ratio is not None:
            words.append(f"{ratio:.3f} on {run.arguments['mesh'] ** 2} elements")
    return f"Five grooves alone, measured apart: {', '.join(words)}." if words else ""


def _us(row: dict[str, Any], what: str) -> str:
    return f"{row[f'{what}_us']:.1f} µs" if row else "not run"


def _note(measured: Measured | None, words: str) -> str:
    """A figure's note: what it is, why it is missing where it is, and the command."""
    if measured is None:
        return f"{words} Not in this budget."
    reason = "" if measured.ok else f" {measured.status}."
    return f"{words}{reason} Again: {measured.command}"


def _run_figures(found: Found) -> list[Figure]:
    sixteen = next((m for m in found["ancf"] if m.arguments["mesh"] == 16), None)
    table5 = found["table5"]
    return [
        at_most(
            "cantilever16_cpu_s",
            "Plain cantilever, 16x16 ANCF elements, 200 implicit steps",
            sixteen and sixteen.get("cpu_seconds"),
            "s CPU",
            10,
            against="cross-code: Chrono's C++ plate with the same coordinates takes 40.7 s",
            note=_note(sixteen, "Mesh and set-up included, interpreter start excluded."),
        ),
        at_most(
            "table5_wall_s",
            "Table 5, both columns, 2x2 to 16x16, dt = 0.01 s",
            table5 and table5.get("wall_seconds"),
            "s",
            60,
            against="the bar alone",
            note=_note(table5, "Wall time of the study of 16 runs in two processes, cheap runs up to three times."),
        ),
    ]


def least(runs: Sequence[Measured], name: str) -> float | None:
    """Least of a value over repeated runs, None where none succeeded."""
    return min((run.get(name) for run in runs if run.ok and run.get(name) is not None), default=None)


def _reference_figures(found: Found) -> list[Figure]:
    ours, theirs, many = found["reference"], found["calculix"], found["many"]
    whole = [run for run in ours if run.get("steps") == 100]
    mine = least(whole, "cpu_seconds")
    peer = least([run for run in theirs if run.get("steps") == 100], "cpu_seconds")
    at = f"{ours[0].get('unknowns')} unknowns, {ours[0].get('tetrahedra')} tetrahedra" if ours[0].ok else "not run"
    steps = f"{ours[0].get('steps')} steps" if ours[0].ok else ""
    absent = f" CalculiX: {theirs[0].status}." if theirs and not theirs[0].ok else ""
    alternating = f"Same mesh ({at}), same {steps}, runs in turn; whole ccx process over our solve, both CPU.{absent}"
    return [
        at_most(
            "reference_5532_cpu_s",
            "Reference: 100 steps on the mesh nearest to 5,532 unknowns",
            least(whole, "cpu_seconds"),
            "s CPU",
            8,
            against="cross-code: CalculiX 2.20 takes about 40 s on 875 C3D10 tetrahedra",
            note=_note(ours[0], f"{at}, mesh and set-up included, least of {len(whole)}."),
        ),
        stated(
            "calculix_cpu_ratio",
            "CalculiX over the reference, same C3D10 mesh and steps",
            peer / mine if peer and mine else None,
            "",
            against="cross-code: CalculiX in this run",
            note=_note(theirs[0] if theirs else None, alternating),
        ),
        *_many_figures(many),
    ]


def _many_figures(many: Measured | None) -> list[Figure]:
    size = f"{many.get('unknowns')} unknowns" if many and many.ok else "100,000 unknowns"
    return [
        at_most(
            "reference_100k_step_s",
            "Reference: slowest time step at 100,000 unknowns",
            many and many.get("slowest_step_seconds"),
            "s",
            10,
            against="the bar alone",
            note=_note(many, f"{size}; wall time with assembly and the analysis of the pattern in the first step."),
        ),
        at_most(
            "reference_100k_newton_s",
            "Reference: one full Newton iteration at 100,000 unknowns",
            many and many.get("newton_seconds"),
            "s",
            3,
            against="cross-code: ngsolve takes 8.7 s, CalculiX about 20 s",
            note=_note(many, f"{size}; wall time of tangent, factorisation, solution and residual."),
        ),
    ]


def _cost_figures(found: Found) -> list[Figure]:
    curves = Curves.of(found["curve"])
    made = []
    for percent, name in ((1.0, "1"), (0.1, "0.1")):
        ratio, why = curves.ratio(percent)
        cpu, _ = curves.ratio(percent, "cpu")
        why += "" if cpu is None else f" The ratio of CPU times is {cpu:.3g}."
        words = f"Patch-loaded plain cantilever, wall time, same steps; errors from {curves.target_words}. {why}"
        label = f"Cost to {name} %: reference over ANCF"
        against = "cross-code: the other solver on the same question"
        key = f"cost_ratio_{name.replace('.', '_')}_percent"
        note = _note(found["curve"], words)
        made.append(
            at_least(key, label, ratio, "", 50, against=against, note=note)
            if percent == 1.0
            else stated(key, label, ratio, "", against=against, note=note)
        )
    return made


def publish(found: Found, budget: str, folder: Path = OUT) -> Path:
    """Write speed.html and speed.json into `folder`; returns the page's path."""
    judged, about, curves = figures(found), provenance(), Curves.of(found["curve"])
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
        print(f"{figure.name:26} {value:>10} {figure.unit:6} {bar:14} {state}")
    print(f"page: {path}")
    return int(any(run.status.startswith("failed") for run in measurements(found)))


if __name__ == "__main__":
    sys.exit(main())
