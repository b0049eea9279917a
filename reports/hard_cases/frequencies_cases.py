"""Cases of the chapter of natural frequencies: what each mode is judged by, and the tables that show them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.convergence import study
from compare.exact import beam_frequency, reentrant_order
from compare.report import Column, Table
from compare.verdict import Figure, stated
from reports.hard_cases.chapter import OK, Case, Chapter, Outcome, case_table
from reports.hard_cases.frequencies_plates import COUNT, CROSS, PLATES, SOLID

Row = dict[str, Any]

# Hz of the modes above the rigid ones; NAFEMS, Selected benchmarks for natural frequency analysis (1987).
FREE_THIN = (1.622, 2.360, 2.922, 4.233, 4.233, 7.416)
SUPPORTED_THIN = (2.377, 5.942, 5.942, 9.507, 11.884, 11.884, 15.449, 15.449)
# FV52 has modes 5-7 and 9 in bending too, which its line support leaves without a limit in a solid.
THICK_BENDING, THICK_IN_PLANE = 45.897, (193.59, 206.19)
BARTON = (3.492, 8.525, 21.43, 27.33, 31.11, 54.44)  # omega a^2 sqrt(rho t / D)


def chapter(outcomes: Sequence[Outcome]) -> Chapter:
    """Cases against closed forms, published tables and the reference; critical steps and cost for information."""
    rows = [row for outcome in outcomes for row in _rows(outcome)]
    exact, published = list(_exact(rows)), list(_published(rows))
    cross, limits = _cross(rows)
    steps = [row for o in outcomes if o.asked.name.endswith("steps") for row in o.get("rows") or []]
    steps = [{**row, "steps": row["period"] / row["seconds"]} for row in steps]
    blocks = [
        case_table("Closed forms", exact, EXACT_NOTES),
        case_table("Published tables", published, PUBLISHED_NOTES),
        case_table("Two solvers, plain and grooved", cross, CROSS_NOTES),
        Table("What the reference's frequencies tend to", LIMITS, limits),
        Table("Explicit time steps", STEPS, steps, STEP_NOTES),
    ]
    return Chapter([*exact, *published, *cross], [*_bound(cross), *_figures(outcomes)], blocks)


def _rows(outcome: Outcome) -> list[Row]:
    """Solved levels with what was asked; a unit that died is a row per Poisson's ratio and element with its failure."""
    asked = outcome.asked.arguments
    if "nus" not in asked:
        return []
    about = {"plate": asked["plate"], "solver": "ancf" if "elements" in asked else "reference"}
    lost = {"level": "-", "h": None, "frequencies": [], "rigid": None, "failure": outcome.measured.status}
    elements = asked.get("elements", [SOLID])
    found = outcome.get("rows") or [{**lost, "nu": nu, "element": e} for nu in asked["nus"] for e in elements]
    return [{**about, **row} for row in found]


def _of(rows: Sequence[Row], plate: str) -> list[Row]:
    return [row for row in rows if row["plate"] == plate]


def _case(row: Row, mode: int, expected: float | None, allowed: float | None, against: str, name: str = "") -> Case:
    """The case of one mode (from 1) of a row."""
    value = row["frequencies"][mode - 1] if row["failure"] == OK else None
    level = f"{row['element']} {row['level']}"
    name = name or f"{row['plate']}, nu {row['nu']:g}, mode {mode}: {level}"
    return Case(name, row["solver"], level, value, "Hz", expected, allowed, against, row["failure"])


def _exact(rows: Sequence[Row]) -> Iterator[Case]:
    """Beams, and the rigid motions of free plates."""
    for plate in ("strip", "ribbed strip"):
        about = PLATES[plate]
        plain = beam_frequency(1, about["length"], about["thickness"], about["young"], about["density"])
        factor = _section(about) if "grooves" in about else 1.0
        for row in _of(rows, plate):
            allowed = 0.2 if row["element"] == "enriched" else 0.5
            yield _case(
                row, 1, factor * plain, allowed, "exact: Euler-Bernoulli beam; shear and inertia of rotation 0.02 %"
            )
    for row in rows:
        if row["plate"] in ("FV12", *CROSS[:2]) and row["nu"] == 0.3:
            name = f"{row['plate']}: rigid motions found, {row['element']} {row['level']}"
            level = f"{row['element']} {row['level']}"
            yield Case(
                name, row["solver"], level, row["rigid"], "", 6, 0.0, "exact: a free body has six", row["failure"]
            )


def _section(about: Row) -> float:
    """Frequency of a beam with a groove along it over that of the plain beam: sqrt(I A_plain / (I_plain A))."""
    ((low, high, depth),), width, t = about["grooves"], about["width"], about["thickness"]
    areas, centres = np.array([width * t, -(high - low) * depth]), np.array([0.0, -(t - depth) / 2])
    own = np.array([width * t**3, -(high - low) * depth**3]) / 12
    moment = own.sum() + areas @ (centres - areas @ centres / areas.sum()) ** 2
    return math.sqrt(moment / areas.sum() * 12 / t**2)


def _published(rows: Sequence[Row]) -> Iterator[Case]:
    """NAFEMS and Barton."""
    about = PLATES["Barton's cantilever"]
    speed = math.sqrt(about["young"] * about["thickness"] ** 2 / (12 * about["density"] * (1 - about["nu"] ** 2)))
    barton = [value * speed / (2 * math.pi * about["length"] ** 2) for value in BARTON]
    for row in _of(rows, "Barton's cantilever"):
        allowed = None if row["element"] == "conforming" else 1.2
        for mode, value in enumerate(barton, 1):
            yield _case(row, mode, value, allowed, "published: Barton 1951, an energy method, within 1 %")
    for plate, values, allowed, why in (
        ("FV12", FREE_THIN, 1.2, "published: NAFEMS FV12, modes 4-9, of a series whose modes 7-9 are 1 % high"),
        ("simply supported", SUPPORTED_THIN, 0.2, "published: NAFEMS, thin plate; its t/a of 1/200 counts 0.02 %"),
    ):
        for row in _of(rows, plate):
            for mode, value in enumerate(values, 1):
                yield _case(row, mode, value, None if row["element"] == "conforming" else allowed, why)
    for row in _of(rows, "FV52"):
        why = "published: NAFEMS FV52, mode 4; a line that holds a solid gives way as h falls, HEX20 land 2.4 % low"
        yield _case(row, 1, THICK_BENDING, 6.0, why)
        for number, value in zip(("8", "9"), THICK_IN_PLANE, strict=True):
            yield _nearest(row, value, number)


def _nearest(row: Row, expected: float, number: str) -> Case:
    """The mode nearest to an in-plane one, which has no fixed place among modes in bending that depend on the mesh."""
    found = row["frequencies"]
    mode = 1 + min(range(len(found)), key=lambda i: abs(found[i] - expected)) if found else 1
    name = f"FV52, nu 0.3, in-plane mode {number}: {row['element']} {row['level']}"
    return _case(row, mode, expected, 0.2, "published: NAFEMS FV52, in the plane, where the line does not act", name)


def _cross(rows: Sequence[Row]) -> tuple[list[Case], list[Row]]:
    """The plates of CROSS against what the reference's ladder tends to, and those limits."""
    cases, limits = [], []
    for plate in CROSS:
        own = _of(rows, plate)
        for nu in sorted({row["nu"] for row in own}):
            solids = [row for row in own if row["solver"] == "reference" and row["nu"] == nu]
            known = [_limit(plate, nu, mode, solids) for mode in range(1, COUNT + 1)]
            limits += known
            for row in own:
                if row["solver"] == "ancf" and row["nu"] == nu:
                    cases += [_against(row, limit) for limit in known]
            cases += [_case(row, 1, None, None, "") for row in solids if row["failure"] != OK]
    return cases, limits


def _limit(plate: str, nu: float, mode: int, solids: Sequence[Row]) -> Row:
    """Richardson value of a mode, or the finest value where the ladder supports none; `own` is its band (%)."""
    solved = [row for row in solids if row["failure"] == OK]
    values = [row["frequencies"][mode - 1] for row in solved]
    highest = reentrant_order(1.5 * math.pi) if PLATES[plate].get("grooves") else math.inf
    seen = study([row["h"] for row in solved], values, highest=highest)
    finest, value = (values[-1] if values else None), seen.extrapolated
    own = seen.gci_percent
    if value is None and len(values) > 1:
        value, own = finest, 100 * abs(values[-1] / values[-2] - 1)
    return {"plate": plate, "nu": nu, "mode": mode, "finest": finest, "value": value, "order": seen.order, "own": own,
            "how": "Richardson value" if seen.extrapolated else "finest level"}  # fmt: skip


def _against(row: Row, limit: Row) -> Case:
    """A mode of a plate against the reference's limit: asked where the plate's own theory reaches it."""
    mode, grooved = limit["mode"], bool(PLATES[row["plate"]].get("grooves"))
    asked = not grooved or (row["plate"] == CROSS[2] and mode == 1)
    allowed = None
    if asked and limit["own"] is not None:
        allowed = limit["own"] + (ENRICHED if row["element"] == "enriched" else locked(row["nu"]))
    why = f"cross-code: {limit['how']} of the reference, its own band {limit['own'] or 0:.2g} %"
    return _case(row, mode, limit["value"], allowed, why if asked else why + "; nothing asked across a groove")


ENRICHED = 1.0  # percent


def locked(nu: float) -> float:
    """Percent by which the conforming element may be high on the meshes here.

    Its thickness cannot follow Poisson's effect. That costs most where both curvatures are equal: the plate's
    E / (1 - nu) becomes E / ((1 + nu)(1 - 2 nu)). Twist, without r_xy, has 192/175 of its energy at nu = 0 where
    the plate is thin; the meshes add 1 %.
    """
    return 100 * (math.sqrt(max(192 / 175, (1 - nu) / ((1 + nu) * (1 - 2 * nu)))) - 1) + 1.0


def _bound(cross: Sequence[Case]) -> Iterator[Figure]:
    """How near the conforming element comes to the reference from above; below it would be no upper bound."""
    found = [case for case in cross if case.level.startswith("conforming") and case.difference is not None]
    least = min(found, key=lambda case: case.difference, default=None)
    label = "Conforming element: least of its frequencies' differences from the reference"
    value = least.difference if least else None
    note = "A displacement-based element with exact integration bounds every frequency from above, so this is positive"
    note += f": {least.name}." if least else "."
    yield stated("conforming_least_percent", label, value, "%", against="theory: Rayleigh-Ritz", note=note, form="+.2g")


def _figures(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """What finding the modes costs; nothing is asked of it."""
    rows = [row for o in outcomes if o.asked.name.endswith("effort") for row in o.get("rows") or []]
    for row in rows:
        note = f"{row['modes_ms']:.0f} ms of CPU time for {COUNT} modes at {row['unknowns']} unknowns: assembly, "
        note += f"one factorisation ({row['factor_ms']:.0f} ms), {row['solves']} solutions."
        label = f"Modes of a 16x16 plate, {row['element']}: CPU time over that of one factorisation"
        ratio = row["modes_ms"] / row["factor_ms"]
        yield stated(f"modes_cost_{row['element']}", label, ratio, "", against="the same process", note=note)


LIMITS = (
    Column("plate", "plate"),
    Column("nu", "ν", ".1f"),
    Column("mode", "mode", "d"),
    Column("finest", "finest", ".6g", "Hz"),
    Column("value", "taken", ".6g", "Hz"),
    Column("how", "which is the"),
    Column("order", "order", ".2f", "observed"),
    Column("own", "band", ".2g", "± %"),
)
STEPS = (
    Column("plate", "plate"),
    Column("element", "element"),
    Column("mesh", "mesh"),
    Column("unknowns", "unknowns", ",d"),
    Column("seconds", "2/ω of the highest mode", ".3g", "s"),
    Column("steps", "steps in a period of the first mode", ",.0f"),
)
EXACT_NOTES = [
    "The ribbed strip is a uniform beam of its grooved section: f / f of the plain one is sqrt(I A₀ / (I₀ A))."
]
PUBLISHED_NOTES = [
    "NAFEMS, Selected benchmarks for natural frequency analysis (1987); Barton, J. Appl. Mech. 18 (1951) 129.",
    "Nothing is asked of the conforming element in thin plates: its twist and, above ν = 0, its bending are too stiff.",
    "FV52 stands on the bottom lines of its four faces. A line has no limit in a solid, so its modes in bending fall "
    "without end as h does (mode 4: 2 % from h = 2 m to 1 m); the modes in the plane have one.",
]
CROSS_NOTES = [
    "Allowed: the band of the reference's ladder (without one, its last change) plus 1 % for the enriched element; for "
    "the conforming one what its locking can cost, the root of (1 − ν)/((1 + ν)(1 − 2ν)) or of 192/175, and 1 %.",
    "Nothing is asked of modes that bend across grooves: they move a groove as a hinge, and its inside deforms in ways "
    "that directors through the whole thickness do not have. The table's first mode bends along its grooves.",
]
STEP_NOTES = [
    "Information: both solvers here are implicit. The highest mode stretches the thickness of the smallest element."
]
