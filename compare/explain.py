"""What a scene will cost and leave out, in words, before anything is solved."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare.treads import PREFIX

if TYPE_CHECKING:
    from compare.scene import Feature, Level, Load, Material, Obstacle, Rim, Scene
    from compare.scene_parts import History

SURFACES = {
    "rectangle": ("rectangle", " m"),
    "nurbs": ("NURBS patch", " (NURBS parameters)"),
    "revolved": ("revolved section", " (angle in rad, NURBS parameter)"),
}


def explain(scene: Scene, budget: str, solvers: dict[str, str]) -> list[str]:
    """Lines for people: the scene, its assumptions, and per solver what is modelled, left out, and each level's size.

    solvers: name in the scene -> dotted module with estimate(scene, level).
    """
    found = [scene.title, f"source: {scene.source or 'not stated'}"]
    found += [f"{about}: {words}" for about, words in statement(scene)]
    found += [f"assumed: {text}" for text in scene.assumed]
    if scene.companions:
        found += [f"companions, run with it: {', '.join(scene.companions)}"]
    for solver, module in solvers.items():
        if levels := scene.ladder(solver, budget):
            found += ["", *_solver(scene, solver, levels, importlib.import_module(module))]
    return found


def statement(scene: Scene) -> list[tuple[str, str]]:
    """What a scene states, as pairs of a subject and its numbers in words, SI units."""
    material, analysis, bands = scene.material, scene.analysis, []
    for kind, members in (("groove", scene.grooves), ("protrusion", scene.protrusions)):
        bands += [(f"{kind} {band.name}", _band(band)) for band in members if not band.name.startswith(PREFIX)]
    if scene.tread is not None:
        bands.append(("tread", _tread(scene)))
    density = "" if material.density is None else f", density {material.density:g} kg/m³"
    span = " and ".join(f"{axis} {_span(limits)}" for axis, limits in zip("xy", scene.surface.span, strict=True))
    surface, unit = SURFACES[scene.surface.kind]
    closed = ", closed" if scene.surface.closed else ""
    second = " s" if analysis.kind == "dynamic" else ""
    found = [
        ("plate", f"{surface}, {span}{unit}{closed}, {scene.thickness:g} m thick"),
        *bands,
        ("material", f"{_material(material)}{density}"),
        *_supports(scene),
        *([] if scene.rim is None else [("rim", _rim(scene.rim, second))]),
        *[("load", _load(load, second)) for load in scene.loads],
        *[(f"obstacle {body.name}", _obstacle(body)) for body in scene.obstacles],
    ]
    if scene.initial is not None:
        turn = f"{_vector(scene.initial.velocity)} m/s, turning at {_vector(scene.initial.angular_velocity)} rad/s"
        found.append(("initial velocity", turn))
    if analysis.kind == "modes":
        found.append(("analysis", "small vibrations about the undeformed plate, which carries no load"))
        return [*found, ("answer", f"the {analysis.count} lowest natural frequencies in Hz, rigid motions not counted")]
    way = ", path followed by arc length" if analysis.follow == "arc-length" else ""
    found.append(("analysis", f"{analysis.kind}, until {analysis.until:g}{second}{way}"))
    what = "height z" if scene.answer == "height" else f"displacement {scene.answer}"
    return [*found, ("answer", f"{what} of {scene.probes[0].name} at the last output time")]


def _material(material: Material) -> str:
    if material.kind == "svk":
        return f"St. Venant-Kirchhoff, E {material.youngs_modulus:g} Pa, ν {material.poissons_ratio:g}"
    constants = f"μ10 {material.mu10:g} Pa, μ01 {material.mu01:g} Pa, k {material.bulk_modulus:g} Pa"
    return f"{'Mooney-Rivlin' if material.mu01 else 'neo-Hookean'}, {constants}"


def _supports(scene: Scene) -> list[tuple[str, str]]:
    """Clamped edges always, as most plates have one; other supports where there are some."""
    clamps = [c for c in scene.supports if c.kind == "clamp"]
    words = [f"{c.edge}, {'all nodal gradients' if c.gradients == 'all' else 'face only'}" for c in clamps]
    found = [("clamped edges", "; ".join(words) or "none")]
    for support in scene.supports:
        if support.kind == "hold":
            place = support.edge or f"corner {support.corner}"
            where = "the whole plate" if support.whole else f"{place}, over its {support.over}"
            found.append(("held", f"{' '.join(support.components)} of {where}"))
        elif support.kind == "symmetry":
            found.append(("symmetry", f"{support.edge} in a plane of normal {support.normal}"))
    return found


def _rim(rim: Rim, second: str) -> str:
    """What it holds, and how it moves."""
    words = f"{' and '.join(rim.edges)} held rigidly"
    words += f", free along {' '.join(rim.free)}" if rim.free else ""
    words += f", {rim.mass:g} kg" if rim.mass else ""
    if any(rim.displacement):
        words += f", moved by {_vector(rim.displacement)} m {_times(rim.history, second)}"
    return words + (f", spinning at {_vector(rim.spin)} rad/s" if any(rim.spin) else "")


def _tread(scene: Scene) -> str:
    tread, count = scene.tread, sum(band.name.startswith(PREFIX) for band in scene.grooves)
    words = f"{tread.kind}, {tread.face} face, travel along {tread.along}, depth {tread.depth:g} m"
    return f"{words}, {100 * tread.void:g} % of the face cut away by {count} grooves"


def _band(band: Feature) -> str:
    if hasattr(band, "outline"):
        x, y = (_span(band.limits(axis)) for axis in (0, 1))
        depth = "a depth that varies" if band.depth is None else f"depth {band.depth:g} m"
        return f"{band.face} face, an outline of degree {band.outline.degree}, x {x}, y {y}, {depth}"
    over = "y" if band.along == "x" else "x"
    shape = f"depth {band.depth:g} m" if band.profile is None else f"a NURBS profile of degree {band.profile.degree}"
    limits = "" if band.extent is None else f" from {_span(band.extent)}"
    return f"{band.face} face, along {band.along}{limits}, {over} {_span(band.edges)}, {shape}"


def _obstacle(body: Obstacle) -> str:
    """Where it stands is in the scene; its law is that of compare/scene_contact.py."""
    per, where = (
        (" per m²", "of the face") if body.law == "pressure" else ("", "at each of the solver's contact points")
    )
    words = f"{body.shape.kind} for the {body.face} face, {body.stiffness:g} N/m{per} {where}"
    words += f", damping {body.damping:g} N s/m{per}" if body.damping else ""
    return words + (f", friction {body.friction:g}" if body.friction else "")


def _load(load: Load, second: str) -> str:
    size = {
        "gravity": lambda: f"{_vector(load.acceleration)} m/s²",
        "pressure": lambda: f"{load.pressure:g} Pa",
        "moment": lambda: f"{_vector(load.moment)} N m",
    }.get(load.kind, lambda: f"{_vector(load.force)} N")()
    place = {
        "point": lambda: f" at {_vector(load.at)}",
        "edge": lambda: f" on {load.edge}",
        "patch": lambda: f" on x {_span(load.region[0])}, y {_span(load.region[1])}",
        "gravity": lambda: "",
        "pressure": lambda: f" into the {load.face} face, {'following it' if load.follower else 'dead'}",
        "moment": lambda: f" on {load.edge}, turning with it",
        "axle": lambda: " on the rim",
    }[load.kind]()
    return f"{load.kind}, {size}{place}, {_times(load.history, second)}"


def _times(history: History, second: str) -> str:
    if len({factor for _, factor in history}) == 1:
        return "constant" if history[0][1] == 1 else f"constant, times {history[0][1]:g}"
    return "times " + ", ".join(f"{factor:g} at {time:g}{second}" for time, factor in history)


def _span(limits: Sequence[float]) -> str:
    return f"{limits[0]:g} to {limits[1]:g}"


def _vector(values: Sequence[float]) -> str:
    return f"({', '.join(f'{value:g}' for value in values)})"


def _solver(scene: Scene, solver: str, levels: tuple, module: object) -> list[str]:
    from compare.levels import names

    estimates = [module.estimate(scene, level) for level in levels]
    lines = [f"{solver}, budget of each level in brackets"]
    for key, shown in (("modelled", "modelled"), ("left_out", "left out")):
        lines += [f"  {shown}: {text}" for text in dict.fromkeys(text for stated in estimates for text in stated[key])]
    named = names(levels)
    width = max(map(len, named))
    for name, level, stated in zip(named, levels, estimates, strict=True):
        lines.append(
            f"  {name:{width}}  {_cost(stated)}{_steps(level)}  [{level.budget}]{_excess(stated['memory_mb'])}"
        )
    return lines


def _cost(stated: dict[str, Any]) -> str:
    """Elements, unknowns and memory of a level."""
    sizes = f"{stated['elements']:>8} elements  {stated['unknowns']:>8} unknowns"
    return f"{sizes}  {stated['memory_mb']:>6.0f} MB"


def _steps(level: Level) -> str:
    """Time step and points of a level, where it has them."""
    from compare.table import rule

    most = "at most " if getattr(level, "error_per_step", None) else ""
    step = "" if level.time_step is None else f"  step {most}{level.time_step:g} s"
    return f"{step}, {rule(level)} points" if rule(level) else step


def _excess(memory_mb: float) -> str:
    """That a level needs more memory than there is, and whether it is refused for that."""
    from compare import pool

    if memory_mb <= pool.physical_mb():
        return ""
    refused = "; refused without --any-size" if pool.too_large(memory_mb) else ""
    return f"  more than the {pool.physical_mb():.0f} MB of this machine{refused}"
