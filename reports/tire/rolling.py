"""The tire rolls on the ground with its rim at a stated height and spin, and slides with its rim locked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from compare.plots import Series, history_plot
from compare.report import Block, Column, Plots, Section, Table, Text
from compare.result import Result
from compare.scene import load
from compare.verdict import Figure, at_most, stated
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire.runs import solved

SCENE = "rolling_tire"
HALVES = 2  # of the scene, that make the tire
RUN = "tire.rolling.rolling"
STEADY = 0.7  # s: from here on it rolls; the rim is at its height at 0.5 s
LOCKED = {"rim.spin": [0.0, 0.0, 0.0], "initial.angular_velocity": [0.0, 0.0, 0.0], "analysis.until": 0.3}
MESHES = {"quick": ([16, 4],), "standard": ([16, 4], [24, 5]), "full": ([16, 4], [24, 5], [32, 8])}
SIZES = {"quick": (), "standard": (0.4,), "full": (0.4, 0.3)}
PATHS = frozenset({"times", "speed", "load", "forward", "moment", "energies"})  # left out of a row in the JSON


def units(budget: str) -> Iterator[Asked]:
    """What is run, the dearest first."""
    yield from (Asked(RUN, {"solver": "reference", "size": size}) for size in reversed(SIZES[budget]))
    yield from (Asked(RUN, {"mesh": mesh}) for mesh in reversed(MESHES[budget]))
    yield Asked(RUN, {"mesh": [16, 4], "way": "locked"})
    if budget != "quick":
        yield Asked(RUN, {"mesh": [16, 4], "time_step": 0.0025})
        yield Asked(RUN, {"solver": "reference", "size": 0.4, "way": "locked"})


def rolling(solver: str = "ancf", way: str = "rolling", **level: Any) -> dict[str, Any]:
    """The scene at one level, numbers of the whole tire.

    way: "rolling", or "locked": without spin, from the same speed, while the rim comes down.
    """
    scene = load(SCENE)
    own = scene.ladder(solver)[0].model_dump(exclude_none=True) | {"budget": "quick"} | level
    scene = scene.override({solver: {"levels": [own]}} | (LOCKED if way == "locked" else {}))
    result = solved(scene, scene.ladder(solver)[0], solver)
    if result.status != "ok":
        return {"status": result.status, "message": result.message}
    found = _common(result)
    return found | (_locked(result, scene) if way == "locked" else _steady(result, scene, found))


def _common(result: Result) -> dict[str, Any]:
    """What is told of either way."""
    total = balance(result)
    force = HALVES * result.contact.force[:, 0]
    return {
        "ended": result.status,
        "unknowns": result.unknowns,
        "h": result.h,
        "steps": result.steps,
        "iterations": result.newton_iterations,
        "cpu_seconds": result.cpu_seconds,
        "mass": HALVES * result.facts["mass"],
        "times": result.times.tolist(),
        "speed": np.gradient(result.rim.displacement[:, 0], result.times).tolist(),
        "load": force[:, 2].tolist(),
        "forward": force[:, 0].tolist(),
        "moment": (HALVES * result.rim.moment[:, 1]).tolist(),
        "energies": {kind: (HALVES * values).tolist() for kind, values in result.energies.items()},
        "drift": float(100 * np.abs(total - total[0]).max() / np.abs(result.energies["external"]).max()),
        "gain": float(100 * (total - np.minimum.accumulate(total)).max() / np.abs(result.energies["external"]).max()),
    }


def balance(result: Result) -> np.ndarray:
    """Kinetic + strain + contact + dissipated - external (t,) in J, which should stay what it was."""
    kinds = ("kinetic", "strain", "contact", "dissipated")
    return sum(result.energies[kind] for kind in kinds) - result.energies["external"]


def _steady(result: Result, scene, found: dict[str, Any]) -> dict[str, Any]:
    """Rolling, from STEADY on: radii (m), load (N), what it costs (N, J per m) and the energy's drift beside that."""
    on = np.flatnonzero(result.times >= STEADY - 1e-9)
    first, last = on[0], on[-1]
    way = result.rim.displacement[last, 0] - result.rim.displacement[first, 0]
    turned = scene.rim.spin[1] * (result.times[last] - result.times[first])
    lost = HALVES * (result.energies["dissipated"][last] - result.energies["dissipated"][first])
    total = HALVES * balance(result)[on]
    tread = result.position("tread") - result.rim.displacement
    loads = np.array(found["load"])[on]
    return {
        "effective_radius": float(way / turned),
        "loaded_radius": float(result.rim.displacement[last, 2] - scene.obstacles[0].shape.point[2]),
        "free_radius": float(np.linalg.norm(tread[:, [0, 2]], axis=1)[on].max()),
        "mean_load": float(loads.mean()),
        "ripple": float(loads.std() / loads.mean()),
        "mean_forward": float(np.mean(np.array(found["forward"])[on])),
        "resistance": float(lost / way),
        "coefficient": float(lost / way / loads.mean()),
        "steady_drift": float(100 * np.abs(total - total[0]).max() / lost),
    }


def _locked(result: Result, scene) -> dict[str, Any]:
    """Sliding: friction over load at every output where the ground is pressed, and impulse over change of momentum."""
    force = HALVES * result.contact.force[:, 0]
    pressed = force[:, 2] > 0.05 * force[:, 2].max()
    ratio = -force[pressed, 0] / force[pressed, 2]
    return {
        "friction": scene.obstacles[0].friction,
        "slides": float(100 * np.abs(ratio / scene.obstacles[0].friction - 1).max()),
        "stopped": float(np.gradient(result.rim.displacement[:, 0], result.times)[-1]),
    }


BAR = 1.0  # %: of the two solvers' rolling radii; loaded and free one are 9 % apart


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """What the rolling tire is judged by."""
    rolled = [o for o in outcomes if o.ok and o.get("effective_radius") is not None]
    plates = [o for o in rolled if "solver" not in o.asked.arguments and "time_step" not in o.asked.arguments]
    plates.sort(key=lambda o: o.get("unknowns"))
    solids = sorted((o for o in rolled if "solver" in o.asked.arguments), key=lambda o: o.get("unknowns"))
    return [
        _radii(rolled),
        *_losses(plates),
        *(_between(plates, solids) if any("solver" in o.asked.arguments for o in outcomes) else ()),
        _sliding([o for o in outcomes if o.ok and o.get("slides") is not None]),
    ]


def _radii(rolled: Sequence[Outcome]) -> Figure:
    """Whether every run rolls on a radius between that under load and that without."""
    value, note = None, ""
    if rolled:
        ends = [(o.get("loaded_radius"), o.get("effective_radius"), o.get("free_radius")) for o in rolled]
        value = max(100 * max(0.0, low - own, own - high) / high for low, own, high in ends)
        note = "; ".join(f"{low:.4f} < {own:.4f} < {high:.4f} m" for low, own, high in ends) + "."
    words = "Effective rolling radius outside of loaded and free radius"
    return at_most("rolling_radius_percent", words, value, "%", 0.0, against="physics: it rolls", note=note)


def _losses(plates: Sequence[Outcome]) -> list[Figure]:
    """Energy of the finest plate."""
    own = plates[-1] if plates else None
    drift = None if own is None else own.get("drift")
    lost = None if own is None else own.get("resistance")
    note = "" if own is None else f"{100 * own.get('coefficient'):.3f} % of the load; rubber is elastic here."
    words = "Drift of the energy while the tire is inflated, lowered and rolls, in percent of the work done on it"
    steady = None if own is None else own.get("steady_drift")
    return [
        at_most("rolling_energy_percent", words, drift, "%", 0.5, against="closed form: constant"),
        stated(
            "rolling_steady_drift_percent",
            "The same while it rolls, in percent of what the ground takes meanwhile",
            steady,
            "%",
            against="closed form: constant",
        ),
        stated("rolling_resistance", "What the ground takes per metre", lost, "N", against="none", note=note),
    ]


def _between(plates: Sequence[Outcome], solids: Sequence[Outcome]) -> list[Figure]:
    """Finest plate against finest solid."""
    values, notes = {}, {}
    for key in ("effective_radius", "mean_load") if plates and solids else ():
        own, other = plates[-1].get(key), solids[-1].get(key)
        values[key], notes[key] = 100 * abs(own / other - 1), f"{own:,.5g} and {other:,.5g}."
    against, stiff = (
        "cross-code: one coarse solid",
        " At a stated height 1 mm of inflated radius is 1.6 kN; see Standing.",
    )
    return [
        at_most(
            "rolling_agree_percent",
            "Effective rolling radius, plate against solid",
            values.get("effective_radius"),
            "%",
            BAR,
            against=against,
            note=notes.get("effective_radius", ""),
        ),
        stated(
            "rolling_load_percent",
            "Load while it rolls at the stated height, plate against solid",
            values.get("mean_load"),
            "%",
            against=against,
            note=notes.get("mean_load", "") + stiff,
        ),
    ]


def _sliding(locked: Sequence[Outcome]) -> Figure:
    """Friction of a locked wheel."""
    value = max((o.get("slides") for o in locked), default=None)
    words = "Friction of a locked wheel that slides, over load, against Coulomb's, at every output"
    return at_most(
        "rolling_slide_percent", words, value, "%", 0.1, against="closed form: mu times the load", form=".2g"
    )


RUNS = (
    Column("solver", "solver"),
    Column("level", "level", "wrap"),
    Column("unknowns", "unknowns", ",d"),
    Column("loaded_radius", "loaded radius", ".4f", "m"),
    Column("effective_radius", "rolling radius", ".4f", "m"),
    Column("free_radius", "free radius", ".4f", "m"),
    Column("mean_load", "mean load", ",.0f", "N"),
    Column("ripple", "its ripple", ".3f"),
    Column("mean_forward", "forward force", ",.0f", "N"),
    Column("resistance", "resistance", ",.0f", "N"),
    Column("drift", "energy drift", ".2f", "%"),
    Column("slides", "friction off mu", ".1e", "%"),
    Column("steps", "steps", "d"),
    Column("iterations", "iterations", "d"),
    Column("cpu_seconds", "CPU", ".0f", "s"),
    Column("status", "status"),
)


def section(outcomes: Sequence[Outcome]) -> Section:
    """The rolling tire."""
    words = [
        "The scene rolling_tire: half of the tire all around, its rim brought down to a stated height and turned at a "
        "constant 4 rad/s; forward it finds its own way. What it rolls on per radian is the effective rolling radius. "
        "The rim's torque pays for what the ground's dampers and friction take, the rubber takes nothing.",
        "Locked, the rim does not turn: the tire slides, and friction must be mu times the load at every instant.",
        "Load and speed ripple as elements and the tire's own undamped vibrations pass through the contact.",
    ]
    table = [_row(o) for o in outcomes]
    blocks: list[Block] = [Text(words), Table("The whole tire's numbers.", RUNS, table)]
    return Section("rolling", "Rolling at constant spin", [*blocks, Plots(list(_plots(outcomes)))], "Rolling")


def _row(o: Outcome) -> dict[str, Any]:
    told = o.asked.arguments
    level = f"{told['size']:g} m" if "size" in told else " x ".join(map(str, told["mesh"]))
    level += f", steps of {told['time_step']:g} s" if "time_step" in told else ""
    level += ", locked" if told.get("way") == "locked" else ""
    own = {column.key: o.get(column.key) for column in RUNS}
    return own | {"solver": told.get("solver", "ancf"), "level": level, "status": o.measured.status}


def _plots(outcomes: Sequence[Outcome]) -> Iterator[tuple[str, str]]:
    """Load, speed and energies over time."""
    rolled = [o for o in outcomes if o.ok and o.get("effective_radius") is not None]
    plates = [o for o in rolled if "solver" not in o.asked.arguments and "time_step" not in o.asked.arguments]
    shown = [(o, "ancf", "plate") for o in sorted(plates, key=lambda o: o.get("unknowns"))[-1:]]
    shown += [(o, "reference", "solid") for o in rolled if "solver" in o.asked.arguments][:1]
    for key, scale, title, unit in (
        ("load", 1e-3, "Load on the ground", "load (kN)"),
        ("speed", 1.0, "Speed of the rim", "speed (m/s)"),
    ):
        series = [Series(label, role, o.get("times"), [scale * v for v in o.get(key)]) for o, role, label in shown]
        yield history_plot(f"rolling-{key}", title, f"{title} over time.", ("t (s)", unit), series, None), f"{title}."
    for o, role, label in shown[:1]:
        roles = {"external": role, "strain": "reference", "dissipated": "ancf exact"}
        series = [
            Series(kind, own, o.get("times"), [v / 1e3 for v in o.get("energies")[kind]]) for kind, own in roles.items()
        ]
        title = f"Work of air and rim, strain, and what the ground took: {label}"
        labels = ("t (s)", "energy (kJ)")
        yield history_plot("rolling-energy", title, "Energies over time.", labels, series, None), f"{title}."
