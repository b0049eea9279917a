"""Chapter: rubber. One plate in motion in both solvers, refined; and how the solid's bulk modulus is split."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from compare.report import Column, Table, Text
from reports.hard_cases.chapter import Asked, Case, Chapter, Outcome

TITLE = "Rubber plates"
HEIGHTS = "hard_cases.rubber_runs.heights"
NEARLY, NEARER = 0.4995, 0.4999
MOVING, RESTING = 0.02, 0.25  # s, of the load: time and load steps
SHIPPED = 20.0  # mu
SPLITS = (5.0, SHIPPED, 100.0, 1e9)  # mu; the last is all of the bulk modulus at the points
ELEMENTS = ("enriched", "conforming")
SIZES = (0.2, 0.1)
ALLOWED = 2.0  # %: what the solid still moves by from its last level but one to its last
AGAINST = "cross-code: the finest enriched plate; the solid still moves by 2.5 % a level"


def units(budget: str) -> list[Asked]:
    """Quick: the plate in motion on one mesh; standard: both solvers refined, and the splits."""
    if budget == "quick":
        return [_asked(NEARLY, "dynamic", "ancf", _plates(MOVING, (4,)))]
    sizes = SIZES if budget == "standard" else (*SIZES, 0.07)
    asked = [_asked(NEARLY, "dynamic", "ancf", _plates(MOVING, (2, 4, 8), element)) for element in ELEMENTS]
    asked += [_asked(NEARLY, "dynamic", "reference", _solids(MOVING, sizes))]
    asked += [_asked(NEARER, "static", "ancf", _plates(RESTING, (4, 8)))]
    fine = {SHIPPED: sizes} if budget == "standard" else dict.fromkeys(SPLITS, sizes)
    for split in SPLITS:
        asked += [_asked(NEARER, "static", "reference", _solids(RESTING, fine.get(split, sizes[:1])), split=split)]
    return asked


def _plates(step: float, meshes: Sequence[int], element: str = "enriched") -> list[dict[str, Any]]:
    return [{"element": element, "mesh": [n, n], "time_step": step} for n in meshes]


def _solids(step: float, sizes: Sequence[float]) -> list[dict[str, Any]]:
    return [{"size": size, "time_step": step} for size in sizes]


def _asked(nu: float, mode: str, solver: str, levels: Sequence[dict[str, Any]], **more: float) -> Asked:
    return Asked(HEIGHTS, {"nu": nu, "mode": mode, "solver": solver, "levels": levels, **more})


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """Every level as a row; those as shipped are cases, of which the finest moving solid is judged."""
    rows = _measured([row for outcome in outcomes for row in _rows(outcome)])
    cases = [_case(row) for row in rows if row["split"] in (None, SHIPPED)]
    tables = [
        Table(f"{words}, nu = {nu:g}", COLUMNS, own, [NOTE])
        for mode, nu, words in (("dynamic", NEARLY, "In motion, at 1 s"), ("static", NEARER, "At rest, by split"))
        if (own := [row for row in rows if row["mode"] == mode])
    ]
    return Chapter(cases, [], [Text(READING), *tables])


def _rows(outcome: Outcome) -> Iterator[dict[str, Any]]:
    asked = outcome.asked.arguments
    lost = {"height": None, "J": None, "unknowns": None, "status": outcome.measured.status}
    found = outcome.get("rows") or [lost] * len(asked["levels"])
    for level, row in zip(asked["levels"], found, strict=True):
        words = "{} {}x{}".format(level["element"], *level["mesh"]) if "mesh" in level else f"h = {level['size']:g}"
        about = {key: asked[key] for key in ("nu", "mode", "solver")} | {"split": asked.get("split"), "level": words}
        yield {**about, **row, "dilatation": None if row["J"] is None else row["J"] - 1}


def _case(row: dict[str, Any]) -> Case:
    name, judged = f"rubber plate, {row['mode']}, nu = {row['nu']:g}: {row['level']}", {}
    if row["is_judged"]:
        judged = {"expected": row["plate"], "allowed": ALLOWED, "against": AGAINST}
    return Case(name, row["solver"], row["level"], row["height"], "m", status=row["status"], **judged)


def _measured(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows with their distance (%) from the finest enriched plate of their table, and whether they are judged."""
    plates, solids = {}, {}
    for row in rows:
        if row["level"].startswith("enriched"):
            plates[row["mode"]] = row["height"]
        elif row["solver"] == "reference":
            solids[row["mode"]] = row["level"]
    found = []
    for row in rows:
        plate, height = plates.get(row["mode"]), row["height"]
        distance = None if plate is None or height is None else 100 * (height - plate) / abs(plate)
        is_judged = row["mode"] == "dynamic" and solids.get("dynamic") == row["level"] and plate is not None
        found.append({**row, "plate": plate, "distance": distance, "is_judged": is_judged})
    return found


READING = (
    "The patch-loaded cantilever of Mooney-Rivlin rubber, mu = 2/3 MPa, 50 N, in both solvers. `from the plate` is the "
    "distance from the finest enriched plate of the same table. In motion the finest solid is judged by it: the "
    "solid's ladder is too short for a limit.",
    "Both solvers meet from their stiff sides as they are refined, the solid from further off: quadratic tetrahedra on "
    "edges of several thicknesses bear near-incompressibility worse than the plate's relaxed thickness does.",
    "The solid lets `of k at points` times mu of its bulk modulus act on det F at each point and the rest on its mean "
    "over each tetrahedron: the less acts at the points, the less a coarse solid locks.",
)
NOTE = "J - 1: at x = 0.3, y = 0.5 m, 0.02 m above the middle. 20 mu is the split as shipped, 1e+09 none."
COLUMNS = (
    Column("solver", "solver"),
    Column("level", "level"),
    Column("split", "of k at points", "g", "mu"),
    Column("unknowns", "unknowns", ",d"),
    Column("height", "height", ".5f", "m"),
    Column("distance", "from the plate", "+.2f", "%"),
    Column("dilatation", "J - 1 at one point", "+.2e"),
    Column("status", "status"),
)
