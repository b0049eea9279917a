"""The treads of Table 1 wrapped onto the tire: what each takes away in both solvers, and how the tire stands on it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.plots import map_plot
from compare.report import Block, Column, Plots, Section, Table, Text
from compare.scene import AncfLevel, load
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import standing
from reports.tire.runs import solved

KINDS = ("rib", "block", "traction", "rock", "smooth")
CROWN = 0.34  # of the section's parameter, on either side of the centre: between the shoulders
PITCHES = 12  # on the half turn that is modelled, 24 around
MESH = [12, 4]
SIZE = 0.3  # m
PLAIN = {"grooves": []}
RUN, STAND = "tire.treads.wrapped", "tire.treads.stood"
BAR = 1.0  # %: the section's own curve is followed to 0.5 % by so few elements


def stated(kind: str) -> dict[str, Any]:
    """Changes of a tire's scene that put a tread on its crown."""
    pattern = {"rib": {"ribs": 5}, "block": {"ribs": 5}, "smooth": {"void": 0.04}}.get(kind, {})
    if kind == "smooth":  # its one groove lies near an edge of the pattern, which the half that is there must have
        pattern["across"] = [0.0, CROWN]
    tread = {"kind": kind, "face": "top", "depth": 0.06, "void": 0.25, "pitches": PITCHES, "across": [-CROWN, CROWN]}
    return PLAIN | {"tread": tread | pattern}


def units(budget: str) -> Iterator[Asked]:
    """What is run."""
    for kind in KINDS:
        yield Asked(RUN, {"kind": kind})
    if budget != "quick":
        yield Asked(STAND, {"kind": "traction", "solver": "reference", "size": SIZE})
        for kind in KINDS:
            yield Asked(STAND, {"kind": kind, "mesh": MESH})


def wrapped(kind: str) -> dict[str, Any]:
    """Volume (m3) that a tread takes from the whole tire in both solvers, what each needs to build it, and how many
    distinct elements there are: a tread of one pitch repeats."""
    from ancf.unpack import build
    from reference_fe.mesh import make
    from reference_fe.unpack import mid_surface, plate_of, spacing_of

    scene = load(standing.SCENE)
    found, volumes = {}, {}
    level = AncfLevel(mesh=tuple(MESH), points=(7, 7, 3), time_step=0.1)
    for name, changes in (("plain", PLAIN), ("treaded", stated(kind))):
        own = scene.override(changes)
        begin = time.process_time()
        model = build(own, level)
        between = time.process_time()
        frame, surface = mid_surface(own)
        plate = plate_of(own, frame, surface)
        solid = make(plate, spacing_of(plate, SIZE), surface)
        found |= {"plate_seconds": between - begin, "solid_seconds": time.process_time() - between}
        volumes[name] = model.body.volume, solid.exact_volume
        found |= {"elements": len(model.mesh.connectivity), "shapes": model.body.shapes, "grooves": len(own.grooves)}
        found |= {"tetrahedra": solid.tetrahedra}
    taken = [standing.QUARTERS * (a - b) for a, b in zip(volumes["plain"], volumes["treaded"], strict=True)]
    return found | {"plate_taken": taken[0], "solid_taken": taken[1], "differ": 100 * abs(taken[0] / taken[1] - 1)}


def stood(kind: str, solver: str = "ancf", **level: Any) -> dict[str, Any]:
    """The standing tire with a tread instead of its four grooves, at one level."""
    scene, own = standing.asked(solver, level, stated(kind))
    return standing.told(solved(scene, own, solver), scene, "loaded")


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """What the treads take away, plate against solid."""
    found = [o for o in outcomes if o.ok and o.get("differ") is not None]
    value = max((o.get("differ") for o in found), default=None)
    note = "; ".join(f"{o.asked.arguments['kind']} {o.get('differ'):.2f}" for o in found)
    words = "Volume that a tread takes from the tire, plate against solid, the worst"
    return [at_most("tread_volume_percent", words, value, "%", BAR, against="cross-code: the solid's CAD", note=note)]


WRAPPED = (
    Column("kind", "tread"),
    Column("grooves", "grooves of the quarter", "d"),
    Column("plate_taken", "taken, plate", ".5f", "m³"),
    Column("solid_taken", "taken, solid", ".5f", "m³"),
    Column("differ", "difference", ".2f", "%"),
    Column("elements", "elements", "d"),
    Column("shapes", "distinct ones", "d"),
    Column("tetrahedra", "tetrahedra", ",d"),
    Column("plate_seconds", "plate built in", ".1f", "s"),
    Column("solid_seconds", "solid cut and meshed in", ".1f", "s"),
    Column("status", "status"),
)
STOOD = (Column("kind", "tread"), *(column for column in standing.RUNS if column.key != "inflation"))


def section(outcomes: Sequence[Outcome]) -> Section:
    """The treads on the tire."""
    words = [
        f"Each pattern of compare/treads.py between the shoulders of the crown, {2 * PITCHES} pitches around, 0.06 m "
        "deep, in place of the four grooves. Elements that see equal parts of the pattern are integrated once: of a "
        "pitch that repeats with the elements only one is."
    ]
    taken = [o for o in outcomes if o.asked.name == RUN]
    stands = [o for o in outcomes if o.asked.name == STAND]
    table = [_row(o, WRAPPED) for o in taken]
    blocks: list[Block] = [Text(words), Table("What the treads take from the whole tire.", WRAPPED, table)]
    if stands:
        blocks.append(Table("The tire on its rim under 160 kN with each tread.", STOOD, [_stood(o) for o in stands]))
        blocks.append(Plots(list(_prints(stands))))
    return Section("treads", "Treads around the tire", blocks, "Treads")


def _row(o: Outcome, columns: Sequence[Column]) -> dict[str, Any]:
    own = {column.key: o.get(column.key) for column in columns}
    return own | {"kind": o.asked.arguments["kind"], "status": o.measured.status}


def _stood(o: Outcome) -> dict[str, Any]:
    return standing.row(o) | {"kind": o.asked.arguments["kind"]}


def _prints(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, str]]:
    """Footprints, mirrored about both planes."""
    for o in outcomes:
        if o.ok and o.get("x"):
            solver, kind = o.asked.arguments.get("solver", "ancf"), o.asked.arguments["kind"]
            x, y, p = (np.array(o.get(key)) for key in ("x", "y", "traction"))
            x, y, p = np.concatenate([x, -x] * 2), np.concatenate([y, y, -y, -y]), np.tile(p / 1e6, 4)
            title, about = f"Footprint of the {kind} tread, {solver}", "Pressure on the tread."
            yield map_plot(f"tread-{kind}-{solver}", title, about, x, y, p, "pressure (MPa)"), f"{title}."
