"""Run the integration study, judge it, write integration.html and integration.json.

    python -m reports.integration --budget quick|standard|full

Every unit runs in a process of its own with one thread.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare import gate
from compare.provenance import provenance
from compare.report import write
from compare.verdict import Figure, at_least, at_most
from reports import frame
from reports.hard_cases.chapter import Asked
from reports.integration import cases
from reports.integration.page import LEAD, page
from reports.unit import Measured

COUNTS = {
    "quick": ([2, 3, 4, 5], [5, 10, 20, 40]),
    "standard": ([1, 2, 3, 4, 5, 6, 7], [3, 5, 7, 10, 14, 20, 28, 40, 56]),
    "full": ([1, 2, 3, 4, 5, 6, 7, 8, 9], [3, 5, 7, 10, 14, 20, 28, 40, 56, 80, 112]),
}
MESHES = {"quick": [1, 3], "standard": [1, 2, 3, 5], "full": [1, 2, 3, 4, 5, 7]}
ENOUGH = 1e-4  # an error that no plot of the norm shows
WHERE = "against gmsh: volume, centroid and inertia of the solid that OCC cuts"


def units(budget: str) -> list[tuple[str, Asked]]:
    """Matrices and volumes of every case."""
    subdomain, whole = COUNTS[budget]
    rules = {"subdomain": subdomain, "whole": whole}
    found = [("matrices", Asked("integration.runs.matrices", {"case": name, **rules})) for name in cases.NAMES]
    meshes = {"meshes": MESHES[budget]}
    return found + [("volumes", Asked("integration.runs.volumes", {"case": name, **meshes})) for name in cases.NAMES]


def run(budget: str, jobs: int = 2, take: frame.Take = frame.afresh) -> tuple[list[Measured], list[Measured]]:
    """Matrices and volumes of every case."""
    parts = frame.outcomes(units(budget), jobs, take)
    return tuple([outcome.measured for outcome in parts[part]] for part in ("matrices", "volumes"))


def rows(matrices: Sequence[Measured]) -> list[dict[str, Any]]:
    """Every measured rule."""
    return [row for measured in matrices for row in measured.get("rows") or ()]


def figures(matrices: Sequence[Measured], volumes: Sequence[Measured]) -> list[Figure]:
    """What the study is judged by."""
    failed = [m.arguments["case"] for m in (*matrices, *volumes) if not m.ok]
    differences = [m.get(key) for m in volumes for key in ("volume_error", "centroid_error", "inertia_error")]
    worst = None if failed else max(differences)
    made = rows(matrices)
    four = _worst(made, cases.POLYNOMIAL, "subdomain", 4)
    three = _worst(made, ("Fig. 4",), "subdomain", 3)
    forty = _worst(made, ("Fig. 4",), "global", 40)
    own = "against its own rule of 9 points, norm of the difference of matrices over the norm"
    about = f"Of {', '.join(cases.POLYNOMIAL)}; the larger of mass and stiffness."
    return [
        at_most("tread_volume_error", "Volume, centroid, inertia: plate rule against the solid", worst, "", 1e-6,
                against=WHERE, note=f"Failed: {', '.join(failed)}." if failed else "All cases on several meshes."),
        at_most("subdomain_error_4_points", "Four points per subdomain, polynomial grooves", four, "", 1e-10,
                against=own, note=about),
        at_most("subdomain_error_3_points", "Fig. 4: three points per subdomain", three, "", ENOUGH, against=own,
                note="Section 5.2 of the paper: more than three points bring nothing."),
        at_least("global_error_40_points", "Fig. 4: forty global points are not enough", forty, "", ENOUGH,
                 against=own, note="Section 5.2 of the paper: more than 40 global points do not converge."),
    ]  # fmt: skip


def _worst(made: Sequence[dict[str, Any]], names: Sequence[str], rule: str, count: int) -> float | None:
    """Largest error of some cases with a rule; None where one is missing."""
    own = [row for row in made if row["case"] in names and row["rule"] == rule and row["count"] == count]
    if len({row["case"] for row in own}) < len(names):
        return None
    return max(max(row["mass_error"], row["stiffness_error"]) for row in own)


def gate_rows(matrices: Sequence[Measured], volumes: Sequence[Measured]) -> list[gate.Row]:
    """What the gate knows of each case: norms of both matrices by two rules, and the plate's volume.

    With OpenBLAS's oldest kernels no row moves by more than 1e-15, so that the gate's 1e-6 and 1e-4 leave room for
    nothing but another rule or groove. (With three points round-off chooses among the thinned rules of a tread: it
    moves the rock tread's mass by 1e-4.) Errors near round-off have bars instead.
    """
    found = []
    for measured in matrices:
        chosen = {(row["rule"], row["count"]): row for row in measured.get("rows") or ()}
        for rule, count in (("subdomain", 4), ("global", 40)):
            row = chosen.get((rule, count), {})
            for word, unit in (("mass", "kg"), ("stiffness", "N/m")):
                found.append(_gated(measured, f"{word}, {rule}, {count} points", row.get(f"{word}_norm"), unit))
    return found + [_gated(measured, "volume", measured.get("volume"), "m3") for measured in volumes]


def _gated(measured: Measured, what: str, value: float | None, unit: str) -> gate.Row:
    return frame.gate_row(f"{measured.arguments['case']}: {what}", "ancf", value, unit, measured.status)


def publish(matrices: Sequence[Measured], volumes: Sequence[Measured], budget: str, folder: Path = frame.OUT) -> Path:
    """Write integration.html and integration.json into `folder`; returns the page's path."""
    judged, about = figures(matrices, volumes), provenance()
    content = frame.content(judged, budget, rows(matrices), about)
    content["volumes"] = [{"case": m.arguments["case"], "status": m.status, **m.values} for m in volumes]
    return write(folder, "integration", page(judged, content["rows"], content["volumes"], about), content)


def main(words: Sequence[str] | None = None) -> int:
    """Run, tell, publish; exit status 1 where a figure missed its bar or a unit failed."""
    options = frame.gated(frame.parser("integration", LEAD)).parse_args(words)
    matrices, volumes = run(options.budget, options.jobs, frame.taking(options.out, options.fresh))
    path = publish(matrices, volumes, options.budget, options.out)
    judged = figures(matrices, volumes)
    frame.print_figures(judged)
    print(f"page: {path}")
    if (passed := frame.passed("integration", gate_rows(matrices, volumes), options)) is not None:
        return int(not passed)
    return int(any(figure.met is not True for figure in judged))
