"""The tire with its beads held is pressed on the ground, inflated or not: axle load and footprint in both solvers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from compare.plots import Series, history_plot
from compare.report import Column, Plots, Section, Table, Text
from compare.verdict import Figure, stated
from reports.hard_cases.chapter import Asked, Outcome

RUN = "tire.runs.pressed"
MESH = [12, 5]  # of the quarter: 24 x 10 elements of the whole tire
DEFLECTION, INFLATION = 0.04, 3e5  # m and Pa of the comparison with the solid


def units(sizes: Sequence[float]) -> Iterator[Asked]:
    """Load-deflection curves with and without inflation, and one point of them by the solid of some sizes (m)."""
    for inflation in (0.0, INFLATION):
        for deflection in (0.01, 0.02, DEFLECTION, 0.06):
            told = {"deflection": deflection, "inflation": inflation, "mesh": MESH}
            yield Asked(RUN, told)
    for size in sizes:
        told = {"deflection": DEFLECTION, "inflation": INFLATION, "solver": "reference", "size": size}
        yield Asked(RUN, told)


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """Axle load and footprint at one deflection against the finest solid's, as figures without a bar."""
    both = [
        o
        for o in outcomes
        if (o.asked.arguments["deflection"], o.asked.arguments["inflation"]) == (DEFLECTION, INFLATION)
    ]
    plates = [o for o in both if "solver" not in o.asked.arguments and o.ok]
    solids = sorted(
        (o for o in both if "solver" in o.asked.arguments and o.ok), key=lambda o: o.asked.arguments["size"]
    )
    made = []
    for key, label in (("load", "Axle load"), ("footprint", "Footprint under it")):
        value, note = None, ""
        if plates and solids:
            signed = 100 * (plates[0].get(key) / solids[0].get(key) - 1)
            value, note = abs(signed), f"{signed:+.2f} %; solids, fine to coarse: "
            note += ", ".join(f"{o.get(key):,.4g}" for o in solids) + "."
        words = f"{label} at {DEFLECTION:g} m and {INFLATION / 1e5:g} bar, beads held, 24 x 10"
        made.append(
            stated(f"static_{key}_percent", words, value, "%", against="cross-code: the finest solid", note=note)
        )
    return made


COLUMNS = (
    Column("solver", "solver"),
    Column("inflation", "inflation", ",.0f", "Pa"),
    Column("deflection", "deflection", ".3f", "m"),
    Column("load", "axle load", ",.0f", "N"),
    Column("footprint", "footprint", ".4f", "m²"),
    Column("ratio", "|J| below", ".4f"),
    Column("unknowns", "unknowns", ",d"),
    Column("iterations", "iterations", "d"),
    Column("cpu_seconds", "CPU", ".2f", "s"),
    Column("status", "status"),
)


def section(outcomes: Sequence[Outcome]) -> Section:
    """The tire with its beads held."""
    words = [
        "Opt-in, each stated by the scene alone: the beads held as on a rigid rim (clamp), inflation that follows the "
        "inner face, statics of the weightless tire. The rim comes nearer to the ground than where the tread touches.",
    ]
    table = [
        {column.key: o.get(column.key) for column in COLUMNS}
        | {key: o.asked.arguments[key] for key in ("inflation", "deflection")}
        | {"solver": o.asked.arguments.get("solver", "ancf"), "status": o.measured.status}
        for o in outcomes
    ]
    lines = []
    for inflation, role in ((0.0, "ancf exact"), (INFLATION, "ancf")):
        own = [
            o
            for o in outcomes
            if o.ok and "solver" not in o.asked.arguments and o.asked.arguments["inflation"] == inflation
        ]
        x, y = [0.0, *(o.asked.arguments["deflection"] for o in own)], [0.0, *(o.get("load") / 1e3 for o in own)]
        lines.append(Series(f"plate, {inflation / 1e5:g} bar", role, x, y))
    solids = [o for o in outcomes if o.ok and "solver" in o.asked.arguments]
    if solids:
        x, y = [o.asked.arguments["deflection"] for o in solids], [o.get("load") / 1e3 for o in solids]
        lines.append(Series("solids", "reference", x, y))
    labels = ("deflection (m)", "axle load (kN)")
    plot = history_plot("pressed", "Load and deflection", "Axle load over the rim's way.", labels, lines, None)
    blocks = [
        Text(words),
        Table("Axle load and footprint.", COLUMNS, table),
        Plots([(plot, "Axle load over deflection.")]),
    ]
    return Section("pressed", "Held by its rim, inflated, loaded", blocks, "Axle load")
