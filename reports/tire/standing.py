"""The tire on its rim, inflated and loaded by its axle: vertical stiffness and footprint, both solvers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.plots import Series, history_plot, map_plot
from compare.report import Block, Column, Plots, Section, Table, Text
from compare.result import Result
from compare.scene import load
from compare.scene_revolved import section_curve
from compare.verdict import Figure, at_most, stated
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import limits
from reports.tire.runs import solved

SCENE = "standing_tire"
QUARTERS = 4  # of the scene, that make the tire
RUN = "tire.standing.standing"
MESH = [12, 4]  # of the quarter, with lines on groove edges 12 x 8: 24 x 16 of the whole tire
EVEN = {"quick": ([12, 5],), "standard": ([6, 3], [12, 5], [16, 8]), "full": ([6, 3], [12, 5], [16, 8], [24, 10])}
LINED = {"quick": (MESH,), "standard": ([8, 3], MESH, [16, 8]), "full": ([8, 3], MESH, [16, 8], [24, 10])}
SIZES = {"quick": (0.4, 0.3), "standard": (0.4, 0.3, 0.22), "full": (0.4, 0.3, 0.22, 0.16)}
PATHS = frozenset({"loads", "radii", "areas", "traction"})  # of an outcome, that its row in the JSON leaves out
FOOT = 0.35  # rad around the lowest point, of a picture
DOTS = 3000  # points of a picture


def units(budget: str) -> Iterator[Asked]:
    """What is run, the dearest first."""
    yield from (Asked(RUN, {"solver": "reference", "size": size}) for size in reversed(SIZES[budget]))
    yield from (Asked(RUN, {"mesh": mesh}) for mesh in EVEN[budget])
    yield from (Asked(RUN, {"mesh": mesh, "fit": [0.4]}) for mesh in LINED[budget])
    yield Asked(RUN, {"mesh": MESH, "fit": [0.4], "inflation": 0.0})
    yield Asked(RUN, {"mesh": MESH, "fit": [0.4], "way": "moved"})


def standing(solver: str = "ancf", inflation: float = 3e5, way: str = "loaded", **level: Any) -> dict[str, Any]:
    """The scene at one level: load, radius under load and footprint of the whole tire, output by output.

    way: "loaded", by the axle as the scene has it, or "moved": the rim goes to where that load would bring it, at the
    same rate, and what keeps it there is the load.
    """
    scene, level = asked(solver, level, {"loads.1.pressure": inflation})
    result = solved(scene, level, solver)
    if way == "moved" and result.status == "ok":
        z = result.rim.displacement[:, 2]
        history = [[float(t), float(u)] for t, u in zip(result.times, z, strict=True)]
        rim = {"rim.free": None, "rim.displacement": [0.0, 0.0, 1.0], "rim.history": history}
        result = solved(_without_axle(scene.override(rim)), level, solver)
    return told(result, scene, way)


def asked(solver: str, level: dict[str, Any], changes: dict[str, Any]) -> tuple[Any, Any]:
    """The scene with some keys set otherwise, and its only level."""
    scene = load(SCENE)
    own = scene.ladder(solver)[0].model_dump(exclude_none=True) | {"budget": "quick"}
    own = {key: value for key, value in own.items() if key != "fit"} | level
    scene = scene.override(changes | {solver: {"levels": [own]}})
    return scene, scene.ladder(solver)[0]


def _without_axle(scene):
    """The scene without the load on its rim."""
    return scene.override({"loads": [item.model_dump(mode="json") for item in scene.loads if item.kind != "axle"]})


def told(result: Result, scene, way: str) -> dict[str, Any]:
    """Numbers of a result, of the whole tire."""
    if result.status != "ok":
        return {"status": result.status, "message": result.message}
    loaded = np.flatnonzero(result.times >= 1.0 - 1e-9)  # inflated by then
    force = QUARTERS * result.contact.force[loaded, 0, 2]
    radius = result.rim.displacement[loaded, 2] - scene.obstacles[0].shape.point[2]
    axle = QUARTERS * -result.rim.force[loaded, 2] if way == "moved" else force
    return {
        "ended": result.status,
        "h": result.h,
        "elements": result.facts.get("elements", result.facts.get("tetrahedra")),
        "unknowns": result.unknowns,
        "iterations": result.newton_iterations,
        "cpu_seconds": result.cpu_seconds,
        "loads": force.tolist(),
        "radii": radius.tolist(),
        "areas": (QUARTERS * result.contact.area[loaded, 0]).tolist(),
        "radius": float(radius[-1]),
        "stiffness": float((force[-1] - force[0]) / (radius[0] - radius[-1])),
        "footprint": float(QUARTERS * result.contact.area[-1, 0]),
        "mean_pressure": float(force[-1] / (QUARTERS * result.contact.area[-1, 0])),
        "ratio": float(result.volume_ratio[-1, 0]),
        "unbalanced": float(np.abs(axle / force - 1).max()),
        "external": float(QUARTERS * result.energies["external"][-1]),
        "stored": float(QUARTERS * sum(result.energies[kind][-1] for kind in ("strain", "contact", "dissipated"))),
        **_footprint(result, scene),
    }


def _footprint(result: Result, scene) -> dict[str, Any]:
    """Length and width (m) of what is pressed, and its picture: places on the tread (m) and tractions (Pa)."""
    x, y, z = result.contact.points.T
    (along, radius), _ = section_curve(scene.surface, y)
    around = (np.pi - x) * (radius + z)
    pressed, near = result.contact.pressure > 0, np.flatnonzero(np.pi - x < FOOT)
    few = np.random.default_rng(0).permutation(near)[:DOTS]
    return {
        "length": float(2 * around[pressed].max(initial=0.0)),
        "width": float(2 * along[pressed].max(initial=0.0)),
        "x": around[few].tolist(),
        "y": along[few].tolist(),
        "traction": result.contact.pressure[few].tolist(),
        "in_grooves": float(result.contact.pressure[z < scene.thickness / 2 - 0.03].max(initial=0.0)),
    }


RUNS = (
    Column("solver", "solver"),
    Column("level", "level", "wrap"),
    Column("inflation", "inflation", ",.0f", "Pa"),
    Column("unknowns", "unknowns", ",d"),
    Column("radius", "loaded radius", ".4f", "m"),
    Column("stiffness", "stiffness", ",.0f", "N/m"),
    Column("footprint", "footprint", ".4f", "m²"),
    Column("length", "its length", ".3f", "m"),
    Column("width", "its width", ".3f", "m"),
    Column("mean_pressure", "mean pressure", ",.0f", "Pa"),
    Column("ratio", "|J| below", ".4f"),
    Column("iterations", "iterations", "d"),
    Column("cpu_seconds", "CPU", ".1f", "s"),
    Column("status", "status"),
)
NUMBERS = ("radius", "stiffness", "footprint", "mean_pressure")
LIMITS = (
    Column("solver", "solver"),
    Column("number", "number"),
    Column("order", "observed order", ".2f"),
    Column("limit", "limit", ".5g"),
    Column("how", "how", "wrap"),
)
BAR = 5.0  # %: that of the fall's footprint, for want of one of its own
LIMIT = "cross-code: the limit of the reference's ladder"


def _inflated(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """The runs of the scene as it stands."""
    return [o for o in outcomes if not {"inflation", "way"} & set(o.asked.arguments)]


def _judged(outcomes: Sequence[Outcome]) -> tuple[limits.Ladder, Outcome | None]:
    """The reference's ladder, and the run of the plate that is judged against it."""
    own = _inflated(outcomes)
    lined = limits.ladder(own, "ancf", True).outcomes
    return limits.ladder(own, "reference"), next((o for o in lined if o.asked.arguments["mesh"] == MESH), None)


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """Stiffness and footprint against the reference, and the balance of what stands on the ground."""
    solids, own = _judged(outcomes)
    made = []
    for key, label in (("stiffness", "Vertical stiffness"), ("footprint", "Footprint under the whole axle load")):
        value, note = None, ""
        if solids.outcomes and own is not None:
            limit, how = solids.limit(key)
            signed = 100 * (own.get(key) / limit - 1)
            value, note = abs(signed), f"{signed:+.2f} %; {how}: {limit:,.4g}."
        words = f"{label} on a rim, 24 x 16 with lines on groove edges"
        made.append(at_most(f"standing_{key}_percent", words, value, "%", BAR, against=LIMIT, note=note))
    moved = next((o for o in outcomes if o.ok and o.asked.arguments.get("way") == "moved"), None)
    value = None if moved is None else 100 * moved.get("unbalanced")
    words = "Load that keeps a moved rim where the axle load had brought it, less that load"
    made.append(at_most("standing_balance_percent", words, value, "%", 1e-4, against="exact: balance of forces"))
    value = None if moved is None else 100 * abs(moved.get("stored") / moved.get("external") - 1)
    words = "Work of inflation and rim less strain, contact and friction"
    against = "exact: balance of energy, to the error of load steps"
    made.append(stated("standing_energy_percent", words, value, "%", against=against, form=".2g"))
    return made


def section(outcomes: Sequence[Outcome]) -> Section:
    """The tire on its rim."""
    words = [
        "The scene standing_tire: both beads on one rigid rim, free up and down; 3 bar follow the inner face while a "
        "tenth of 160 kN stands on the axle, then the load is raised by steps. The loaded radius is the height of the "
        "axle above the ground, the stiffness the secant from a tenth of the load to the whole. Rim, air and "
        "load are each stated by the scene alone; one without a rim loads none of its code."
    ]
    table = [row(o) for o in outcomes]
    blocks: list[Block] = [Text(words), Table("The whole tire's numbers.", RUNS, table)]
    found = list(_limits(outcomes))
    blocks += [Table("Orders and limits.", LIMITS, found)] if found else []
    plots = [*_curves(outcomes), *_prints(outcomes)]
    return Section("standing", "On its rim, under its axle load", [*blocks, Plots(plots)], "Standing")


def row(o: Outcome) -> dict[str, Any]:
    """A run as a row."""
    told = o.asked.arguments
    level = f"{told['size']:g} m" if "size" in told else " x ".join(map(str, told["mesh"]))
    level += ", lines on groove edges" if "fit" in told else ""
    level += ", rim moved instead of loaded" if told.get("way") == "moved" else ""
    own = {column.key: o.get(column.key) for column in RUNS}
    more = {"solver": told.get("solver", "ancf"), "level": level, "inflation": told.get("inflation", 3e5)}
    return own | more | {"status": o.measured.status}


def _limits(outcomes: Sequence[Outcome]) -> Iterator[dict[str, Any]]:
    own = _inflated(outcomes)
    ladders = (("reference", "reference", False), ("ancf, even lines", "ancf", False), ("ancf, lines", "ancf", True))
    for name, solver, fitted in ladders:
        ladder = limits.ladder(own, solver, fitted)
        for key in NUMBERS if len(ladder.outcomes) > 1 else ():
            limit, how = ladder.limit(key)
            order = ladder.convergence(key).order
            yield {"solver": name, "number": key.replace("_", " "), "order": order, "limit": limit, "how": how}


def _shown(outcomes: Sequence[Outcome]) -> list[tuple[Outcome, str, str]]:
    """The finest solid and the judged plate, with the roles and labels of their lines."""
    solids, own = _judged(outcomes)
    found = [] if own is None else [(own, "ancf", "plate, 3 bar")]
    found += [(o, "reference", "finest solid, 3 bar") for o in solids.outcomes[-1:]]
    return found


def _curves(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, str]]:
    """Load and footprint over the loaded radius."""
    lines = _shown(outcomes)
    flat = [o for o in outcomes if o.ok and o.asked.arguments.get("inflation") == 0.0]
    lines += [(o, "ancf exact", "plate, no air") for o in flat]
    for key, scale, title, unit in (
        ("loads", 1e-3, "Axle load", "axle load (kN)"),
        ("areas", 1.0, "Footprint", "pressed area (m²)"),
    ):
        series = [Series(label, role, o.get("radii"), [scale * v for v in o.get(key)]) for o, role, label in lines]
        labels = ("loaded radius (m)", unit)
        about = f"{title} over the height of the axle above the ground."
        yield history_plot(f"standing-{key}", title, about, labels, series, None), about


def _prints(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, str]]:
    """Pictures of the footprint, mirrored about both planes of symmetry."""
    for o, role, label in _shown(outcomes):
        x, y, p = (np.array(o.get(key)) for key in ("x", "y", "traction"))
        x, y, p = np.concatenate([x, -x] * 2), np.concatenate([y, y, -y, -y]), np.tile(p / 1e6, 4)
        title = f"Footprint under the whole load: {label}"
        about = "Pressure on the tread."
        yield map_plot(f"standing-print-{role}", title, about, x, y, p, "pressure (MPa)"), f"{title}."
