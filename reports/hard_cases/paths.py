"""Paths: snap-through followed by arc length, and loads that one step cannot carry.

Closed forms: von Mises's truss and a crushed bar, which the elements hold exactly, and the shallow clamped arch.
Published: the hinged cylindrical roof of Sabir and Lock (1972) as Sze, Liu and Lo (2004) compute it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ancf.run import solve
from compare.plots import Series, history_plot
from compare.report import Plots, Text
from compare.scene import AncfLevel, ReferenceLevel, Scene, load, parse
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import OK, Asked, Case, Chapter, Outcome, case_table

TITLE = "Snap-through, limit loads and cut load steps"
E, RAMP = 2.0e6, [[0.0, 0.0], [1.0, 1.0]]
ENRICHED, CONFORMING = "enriched", "conforming"
# Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551, Tables 9a and 9d: load over 3000 N and deflection (mm) at the
# highest printed point, by thickness (m), as transcribed in the public validation data of the panels package.
ROOFS = {0.0127: (0.7421, 11.293), 0.00635: (0.1953, 12.892)}
STRIP = {"length": 1.0, "rise": 0.05, "width": 0.2, "thickness": 0.05}
FOLLOWED = {
    "quick": (("truss", ENRICHED, 1, 0.2), ("bar", ENRICHED, 1, 0.1), ("arch", ENRICHED, 12, 0.4),
              ("roof 12.7 mm", ENRICHED, 4, 0.1)),
    "standard": (("truss", ENRICHED, 2, 0.2), ("truss", CONFORMING, 2, 0.2), ("truss", ENRICHED, 2, 0.05),
                 ("bar", ENRICHED, 2, 0.1), ("bar", CONFORMING, 2, 0.1),
                 ("arch", ENRICHED, 16, 0.4), ("arch", ENRICHED, 16, 0.1), ("arch", CONFORMING, 16, 0.4),
                 ("roof 12.7 mm", ENRICHED, 8, 0.1), ("roof 12.7 mm", ENRICHED, 8, 0.2),
                 ("roof 6.35 mm", ENRICHED, 8, 0.1)),
}  # fmt: skip
FOLLOWED["full"] = (*FOLLOWED["standard"], ("roof 12.7 mm", CONFORMING, 16, 0.1), ("roof 6.35 mm", ENRICHED, 8, 0.05))
CUTS = {
    "quick": ((500.0, 0.0),),
    "standard": ((500.0, 0.0), (500.0, 0.4999), (5000.0, 0.3), (5000.0, 0.4999)),
}
CUTS["full"] = CUTS["standard"]


def units(budget: str) -> list[Asked]:
    """Paths by arc length, the load steps that end at a limit point, and large loads in one step and in twenty."""
    here = __name__.removeprefix("reports.")
    asked = [
        Asked(f"{here}.followed", {"case": case, "element": element, "mesh": mesh, "step": step})
        for case, element, mesh, step in FOLLOWED[budget]
    ]
    asked.append(Asked(f"{here}.crushed", {}))
    for force, nu in CUTS[budget]:
        asked += [Asked(f"{here}.loaded", {"solver": "ancf", "force": force, "nu": nu, "step": s}) for s in (1.0, 0.05)]
    asked += [
        Asked(f"{here}.loaded", {"solver": "reference", "force": 500.0, "nu": 0.0, "step": s}) for s in (1.0, 0.1)
    ]
    return asked


def scene(case: str) -> Scene:
    """The question of a case: its greatest load parameter, 1, lies beyond the limit point where there is a way up."""
    if case == "arch":
        return load("shallow_arch")
    return parse({"truss": _truss, "bar": _bar}[case]() if case in ("truss", "bar") else _roof(case), case)


def _plate(name: str, thickness: float, force: dict, probe: tuple[float, float], **more: Any) -> dict[str, Any]:
    return {
        "name": name, "title": name, "thickness": thickness, "loads": [{**force, "history": RAMP}],
        "probes": [{"name": "P", "at": [*probe, 0.0]}],
        "analysis": {"kind": "static", "follow": "arc-length"},
        "ancf": {"levels": [{"mesh": [1, 1], "time_step": 0.1}]},
        **more,
    }  # fmt: skip


def _truss() -> dict[str, Any]:
    """Half of von Mises's truss, a strip hinged at its foot whose top is guided, under 1.5 times its limit load."""
    width, rise = STRIP["width"], STRIP["rise"]
    corners = [[[x, y, rise * x] for y in (0.0, width)] for x in (0.0, STRIP["length"])]
    force = {"kind": "edge", "edge": "x1", "force": [0.0, 0.0, -1.5 * truss_limit()]}
    return _plate(
        "truss", STRIP["thickness"], force, (1.0, 0.5),
        surface={"kind": "nurbs", "degree": [1, 1], "knots": [[0, 0, 1, 1], [0, 0, 1, 1]], "control_points": corners},
        material={"kind": "svk", "youngs_modulus": E},
        supports=[{"kind": "hold", "edge": "x0", "components": ["X", "Y", "Z"], "over": "middle"},
                  {"kind": "hold", "edge": "x1", "components": ["X", "Y"], "over": "middle"}],
    )  # fmt: skip


def _bar() -> dict[str, Any]:
    """A bar pushed along its axis with twice the greatest force that St. Venant-Kirchhoff's solid carries."""
    force = -2 * bar_force(1 / np.sqrt(3))
    return _plate(
        "bar", 0.05, {"kind": "edge", "edge": "x1", "force": [-force, 0.0, 0.0]}, (1.2, 0.3),
        surface={"kind": "rectangle", "length": 1.2, "width": 0.6}, material={"kind": "svk", "youngs_modulus": E},
        supports=[{"kind": "clamp", "edge": "x0"}],
    )  # fmt: skip


def _roof(case: str) -> dict[str, Any]:
    """Cylindrical roof on two hinged straight edges under a point load in its middle."""
    radius, half, angle, thickness = 2.54, 0.254, 0.1, float(case.split()[1]) / 1000
    sine, cosine = radius * np.sin(angle), radius * np.cos(angle)
    arc = [(-sine, cosine - radius), (0.0, radius / np.cos(angle) - radius), (sine, cosine - radius)]
    most = 3000.0 if thickness > 0.01 else 1000.0
    hinges = [{"kind": "hold", "edge": e, "components": ["X", "Y", "Z"], "over": "middle"} for e in ("y0", "y1")]
    return _plate(
        "roof", thickness, {"kind": "point", "at": [half, 0.5], "force": [0.0, 0.0, -most]}, (half, 0.5),
        surface={"kind": "nurbs", "degree": [1, 2], "knots": [[0, 0, 2 * half, 2 * half], [0, 0, 0, 1, 1, 1]],
                 "control_points": [[[x, float(y), float(z)] for y, z in arc] for x in (0.0, 2 * half)],
                 "weights": [[1.0, float(np.cos(angle)), 1.0]] * 2},
        material={"kind": "svk", "youngs_modulus": 3102.75e6, "poissons_ratio": 0.3}, supports=hinges,
    )  # fmt: skip


def bar_force(s: np.ndarray | float, area: float = 0.6 * 0.05) -> np.ndarray | float:
    """Force (N) of a St. Venant-Kirchhoff bar of nu = 0 stretched to s: E A s (s^2 - 1)/2, least at s = 1/sqrt(3)."""
    return E * area * s * (s**2 - 1) / 2


def truss_load(w: np.ndarray) -> np.ndarray:
    """Load (N) on half of von Mises's truss whose top has come down by w (m): twice the bar's vertical force halved."""
    rise, base = STRIP["rise"], STRIP["length"]
    length = np.hypot(base, rise - w)
    area = STRIP["width"] * STRIP["thickness"]
    return -bar_force(length / np.hypot(base, rise), area) * (rise - w) / length


def truss_limit() -> float:
    """Greatest load (N) before the truss is flat."""
    return float(truss_load(np.linspace(0.0, STRIP["rise"], 200_001)).max())


def arch_limit() -> float:
    """Limit load (N) of the shipped shallow arch, clamped, symmetric, of nu = 0, under uniform vertical load.

    With rise z = h - x^2 / 2R, half span a and axial force N = E I k^2 the deflection w of a shallow arch obeys
    E I w'''' + N w'' = q - N / R and N / E A = mean of (z' w' - w'^2 / 2). Clamped ends give
    w' = p (x - a sin kx / sin ka), p = q / N - 1 / R; the mean is quadratic in p, which leaves q as a function of k.
    """
    a, thickness, width, radius = 0.5, 0.0025, 0.1, 12.5
    ka = np.linspace(3.3, 5.3, 400_001)
    k, s, c = ka / a, np.sin(ka), np.cos(ka)
    N = E * width * thickness**3 / 12 * k**2
    xs = 2 * (s / k**2 - a * c / k)  # integral of x sin kx from -a to a
    first = 2 * a**3 / 3 - a / s * xs
    second = 2 * a**3 / 3 - 2 * a / s * xs + (a / s) ** 2 * (a - np.sin(2 * ka) / (2 * k))
    root = (first / radius) ** 2 - 4 * a * second * N / (E * width * thickness)
    with np.errstate(invalid="ignore"):
        p = (-first / radius + np.array([[1], [-1]]) * np.sqrt(root)) / second
    return float(np.nanmax(N * (p + 1 / radius)) * 2 * a)


def followed(case: str, element: str, mesh: int, step: float) -> dict[str, Any]:
    """A path by arc length: loads (N) and displacements (m) of the probe along it, its limit load, its end."""
    question = scene(case)
    elements = {"arch": (1, mesh), "truss": (mesh, 1), "bar": (mesh, 1)}.get(case, (mesh, mesh))
    result = solve(question, AncfLevel(mesh=elements, element=element, time_step=step))
    along = 0 if case == "bar" else 2
    size = abs(question.loads[0].force[along])
    found, moved = size * result.load_parameter, -result.displacement[:, 0, along]
    top = next((i for i in range(1, len(found) - 1) if found[i] > found[i + 1]), None)
    return {
        "ended": result.status,
        "load": found.tolist(),
        "moved": moved.tolist(),
        "limit": None if top is None else _peak(result.times[top - 1 : top + 2], found[top - 1 : top + 2]),
        "end": float(moved[-1]) if result.status == OK else None,
        "off": _off(case, found, moved),
        "points": len(found),
        "iterations": result.newton_iterations,
    }


def _peak(s: np.ndarray, values: np.ndarray) -> float:
    """Top of the parabola through three points."""
    c, b, a = np.polynomial.polynomial.polyfit(s - s[1], values, 2)
    return float(c - b**2 / (4 * a))


def _off(case: str, found: np.ndarray, moved: np.ndarray) -> float | None:
    """Largest distance from a closed form, over the limit load; None where there is none along the whole path."""
    if case not in ("truss", "bar"):
        return None
    exact = truss_load(moved) if case == "truss" else -bar_force(1 - moved / 1.2)
    limit = truss_limit() if case == "truss" else -bar_force(1 / np.sqrt(3))
    return float(np.abs(found - exact).max() / limit)


def crushed() -> dict[str, Any]:
    """The bar by load steps: beyond its greatest force there is no equilibrium but inside out."""
    question = scene("bar").override({"analysis.follow": "load"})
    result = solve(question, AncfLevel(mesh=(2, 1), element=ENRICHED, time_step=0.05))
    return {"ended": result.status}


def loaded(solver: str, force: float, nu: float, step: float) -> dict[str, Any]:
    """Static height of the plain patch-loaded cantilever under a force in load steps of `step`, and the steps made."""
    changes = {"loads.0.force": [0.0, 0.0, -force], "material.poissons_ratio": nu, "analysis": {"kind": "static"}}
    question = load("cantilever_plain_patch")
    if solver == "ancf":
        level = AncfLevel(mesh=(4, 4), element=ENRICHED, time_step=step)
        result = solve(question.override({**changes, "ancf": _alone(level), "reference": None}), level)
    else:
        from reference_fe.run import solve as solve_reference  # gmsh is loaded where it is asked for

        level = ReferenceLevel(size=0.4, time_step=step)
        result = solve_reference(question.override({**changes, "reference": _alone(level), "ancf": None}), level)
    value = float(result.position("P")[-1, 2]) if result.status == OK else None
    return {"ended": result.status, "value": value, "steps": result.steps, "iterations": result.newton_iterations}


def _alone(level: AncfLevel | ReferenceLevel) -> dict[str, Any]:
    return {"levels": [level.model_dump(mode="json")]}


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """Cases, figures and curves."""
    paths = [o for o in outcomes if "case" in o.asked.arguments]
    limits = [case for o in paths for case in _path_cases(o, paths)]
    crushing = next(o for o in outcomes if not o.asked.arguments)
    cuts = [_crushed_case(crushing), *_cut_cases([o for o in outcomes if "solver" in o.asked.arguments])]
    blocks = [
        Text([
            "Statics with analysis.follow = \"arc-length\" takes the load parameter as an unknown of each step, so the "
            "load may fall where a shell snaps through. The limit load is the top of the parabola through the three "
            "highest points. Two closed forms hold along the whole path, falling branch included: the strips of von "
            "Mises's truss and the crushed bar only turn and stretch, which the elements represent exactly.",
        ]),
        case_table("Paths through limit points", limits, [
            "The conforming element is shown on the arch and the roof, not judged: it is too stiff in bending.",
            "The roof's published loads are the highest points printed of coarse paths of another code's shell "
            "elements (1 % is asked).",
        ]),
        Plots([plot for plot in (_plot("roof", paths), _plot("arch", paths)) if plot]),
        case_table("Loads that one load step may not carry", cuts, [
            "The whole load in one step against the same in small ones; a step that fails is cut. "
            "Beyond the greatest force of a bar load steps have nowhere to go: a named failure.",
        ]),
    ]  # fmt: skip
    return Chapter([*limits, *cuts], _figures(limits), blocks)


def _path_cases(outcome: Outcome, paths: Sequence[Outcome]) -> list[Case]:
    """Limit load, the whole path where a closed form has it, and the end against that of another step."""
    case, element, mesh, step = (outcome.asked.arguments[key] for key in ("case", "element", "mesh", "step"))
    level = f"{mesh} {element}, step {step:g}"
    ended = outcome.get("ended") or outcome.measured.status
    known = outcome.get("limit") is not None
    judged = element == ENRICHED or case in ("truss", "bar")
    expected, allowed, against = _limit(case)
    status = OK if case == "bar" and known else ended  # crushed flat at the end of its path
    cases = [Case(f"{case}, {element}, step {step:g}: limit load", "ancf", level, outcome.get("limit"), "N", expected,
                  allowed if judged else None, against, status)]  # fmt: skip
    if outcome.get("off") is not None:
        words = "exact: every point of the path; tolerance: that of Newton's method"
        value = 1.0 + outcome.get("off")
        cases.append(Case(f"{case}, {element}, step {step:g}: path", "ancf", level, value, "of P(w)", 1.0, 1e-6, words))
    same = [o for o in paths if o.asked.arguments | {"step": step} == outcome.asked.arguments]
    first = same[0]
    if outcome is not first:
        words = f"self: the end reached by steps of {first.asked.arguments['step']:g}; tolerance: Newton's method"
        end, other = outcome.get("end"), first.get("end")
        cases.append(Case(f"{case}, {element}, step {step:g}: end", "ancf", level, end, "m", other, 1e-6, words, ended))
    return cases


def _limit(case: str) -> tuple[float, float, str]:
    """Expected limit load (N), percent allowed, source and reason."""
    parabola = "the parabola through three points"
    if case == "truss":
        return truss_limit(), 1.0, f"exact: von Mises's truss; tolerance: {parabola}"
    if case == "bar":
        return float(-bar_force(1 / np.sqrt(3))), 1.0, f"exact: E A / (3 sqrt 3); tolerance: {parabola}"
    if case == "arch":
        return arch_limit(), 0.5, f"exact: shallow clamped arch; tolerance: twelve elements or more, and {parabola}"
    ratio, _ = ROOFS[float(case.split()[1]) / 1000]
    return 3000 * ratio, 1.0, "published: Sze, Liu, Lo 2004, Table 9; tolerance: points printed of a coarse path"


def _crushed_case(outcome: Outcome) -> Case:
    ended = outcome.get("ended") or outcome.measured.status
    return Case("bar beyond its greatest force, load steps (allowed to fail)", "ancf", "2 enriched", None, "N",
                status=ended, may_fail=("newton_diverged",))  # fmt: skip


def _cut_cases(outcomes: Sequence[Outcome]) -> list[Case]:
    cases = []
    for one, other in zip(outcomes[::2], outcomes[1::2], strict=True):
        asked = one.asked.arguments
        level = "4x4 enriched" if asked["solver"] == "ancf" else "size 0.4 m"
        name = f"{asked['solver']}: {asked['force']:g} N, nu = {asked['nu']:g} in one load step"
        step, made = other.asked.arguments["step"], one.get("steps")
        small = f"self: steps of {step:g}; cut into {made} parts here; tolerance: that of Newton's method"
        ended = one.get("ended") or one.measured.status
        cases.append(Case(name, asked["solver"], level, one.get("value"), "m", other.get("value"), 1e-4, small, ended))
    return cases


def _figures(limits: Sequence[Case]) -> list[Figure]:
    judged = [c for c in limits if c.allowed is not None and "limit" in c.name]
    missing = any(c.difference is None for c in judged)
    value = None if missing or not judged else max(abs(c.difference) for c in judged)
    note = "Largest difference of the judged limit loads: truss, crushed bar, clamped arch, hinged roofs."
    return [at_most("limit_load_percent", "Limit loads", value, "%", 1.0, against="each case's own source", note=note)]


def _plot(kind: str, paths: Sequence[Outcome]) -> tuple[str, str] | None:
    """Load over displacement of the first path of each kind by the enriched element."""
    shown = [o for o in paths if o.asked.arguments["case"].startswith(kind) and o.get("load")]
    first = {}
    for outcome in shown:
        first.setdefault((outcome.asked.arguments["case"], outcome.asked.arguments["element"]), outcome)
    roles = iter(("ancf", "reference", "difference"))
    lines = [
        Series(f"{case}, {element}", next(roles), 1e3 * np.array(o.get("moved")), o.get("load"))
        for (case, element), o in first.items()
    ]
    if not lines:
        return None
    caption = f"{kind}: load over displacement under it; each path ends where the load parameter is 1."
    labels = ("displacement (mm)", "load (N)")
    return history_plot(f"path-{kind}", f"Path of the {kind}", caption, labels, lines, None), caption
