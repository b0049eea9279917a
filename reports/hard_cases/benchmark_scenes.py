"""The published benchmarks as scenes, and one of them solved at one resolution.

Each builder states the geometry, material, supports, loads and probes of its source and nothing of a solver;
`SCENES` names them. Lengths, moduli and forces are in the source's own units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from compare.scene import AncfLevel, ReferenceLevel, Scene, parse
from reports.hard_cases import benchmark_rubber as rubber

ROOT = math.sqrt(0.5)
SMALL = 1e-6  # factor of a load whose answer is meant to be linear


def scene(
    title: str,
    surface: dict,
    thickness: float,
    material: tuple[float, float],
    supports: Sequence[dict],
    loads: Sequence[dict],
    probes: dict[str, Sequence[float]],
    stages: int = 1,
) -> Scene:
    """A static scene whose loads grow in proportion over the load parameter 0 to `stages`, told at each whole one.

    material: Young's modulus and Poisson's ratio.
    """
    ramp = [[0.0, 0.0], [float(stages), 1.0]]
    return parse(
        {
            "name": "benchmark",
            "title": title,
            "surface": surface,
            "thickness": thickness,
            "material": {"kind": "svk", "youngs_modulus": material[0], "poissons_ratio": material[1]},
            "supports": list(supports),
            "loads": [{"history": ramp, **load} for load in loads],
            "probes": [{"name": name, "at": list(at)} for name, at in probes.items()],
            "analysis": {"kind": "static", "until": float(stages), "every": 1.0},
            "reference": {"levels": [{"size": 1.0, "time_step": 1.0}]},
        },
        title,
    )


def rectangle(length: float, width: float) -> dict:
    """A flat mid-surface."""
    return {"kind": "rectangle", "length": length, "width": width}


CLAMP = {"kind": "clamp", "edge": "x0"}


def elastica() -> Scene:
    """Sze, Liu, Lo 2004, section 3.1, with EI = 100 and L = 10, so that the load is alpha; stage k is alpha = k."""
    load = {"kind": "edge", "edge": "x1", "force": [0.0, 0.0, 15.0]}
    tip = {"tip": (10.0, 0.5, 0.0)}
    return scene("Elastica", rectangle(10.0, 1.0), 0.1, (1.2e6, 0.0), [CLAMP], [load], tip, stages=15)


def roll_up(turns: float = 1.0) -> Scene:
    """Sze, Liu, Lo 2004, section 3.2; stage k is k / 20 of the moment that closes the circle, up to `turns` of it."""
    load = {"kind": "moment", "edge": "x1", "moment": [0.0, -turns * 50 * math.pi / 3, 0.0]}
    tip = {"tip": (12.0, 0.5, 0.0)}
    return scene("Roll-up", rectangle(12.0, 1.0), 0.1, (1.2e6, 0.0), [CLAMP], [load], tip, round(20 * turns))


def corner_load() -> Scene:
    """Yamashita, Valkeapaa, Jayakumar, Sugiyama 2015, Fig. 4: the steady state, as statics."""
    load = {"kind": "point", "at": [1.0, 1.0], "force": [0.0, 0.0, -50.0]}
    corners = {"loaded": (1.0, 1.0, 0.0), "other": (1.0, 0.0, 0.0)}
    return scene("Corner load", rectangle(1.0, 1.0), 0.01, (2.1e8, 0.3), [CLAMP], [load], corners)


def princeton(force: float, angle: float) -> Scene:
    """Princeton beam: y chordwise (the strong way), z flapwise; angle in degrees from the chord."""
    beta = math.radians(angle)
    load = {"kind": "edge", "edge": "x1", "force": [0.0, force * math.cos(beta), force * math.sin(beta)]}
    width, thickness = 12.3777e-3, 3.2024e-3
    tip = {"tip": (0.508, width / 2, 0.0)}
    return scene("Princeton beam", rectangle(0.508, width), thickness, (71.7e9, 0.31), [CLAMP], [load], tip)


def cook(plane: str, nu: float) -> Scene:
    """Cook's membrane, at SMALL times the load. plane "stress": E = 1, F = 1; "strain": E = 70, 6.25 on the edge.

    The plate lies in the plane, its thickness is 1.
    """
    corners = [[[0.0, 0.0, 0.0], [0.0, 44.0, 0.0]], [[48.0, 44.0, 0.0], [48.0, 60.0, 0.0]]]
    surface = {"kind": "nurbs", "degree": [1, 1], "knots": [[0, 0, 1, 1]] * 2, "control_points": corners}
    flat = [{"kind": "hold", "whole": True, "components": ["Z"]}] if plane == "strain" else []
    young, force = (70.0, 100.0) if plane == "strain" else (1.0, 1.0)
    load = {"kind": "edge", "edge": "x1", "force": [0.0, SMALL * force, 0.0]}
    tips = {"corner": (1.0, 1.0, 0.0), "middle": (1.0, 0.5, 0.0)}
    return scene("Cook's membrane", surface, 1.0, (young, nu), [CLAMP, *flat], [load], tips)


def thick_plate() -> Scene:
    """NAFEMS LE10: quarter of an elliptic annulus; radius along x, angle along y. Probes on the top inner edge.

    Point D is at Y = 0 there; "a" and "b" lie beside it, for the hoop strain.
    """
    inner, outer = (2.0, 1.0), (3.25, 2.75)
    rows = [[[a, 0.0, 0.0], [a, b, 0.0], [0.0, b, 0.0]] for a, b in (inner, outer)]
    surface = {"kind": "nurbs", "degree": [1, 2], "knots": [[0, 0, 1, 1], [0, 0, 0, 1, 1, 1]], "control_points": rows}
    supports = [
        {"kind": "symmetry", "edge": "y0", "normal": "Y"},
        {"kind": "symmetry", "edge": "y1", "normal": "X"},
        {"kind": "hold", "edge": "x1", "components": ["X", "Y"]},
        {"kind": "hold", "edge": "x1", "components": ["Z"], "over": "middle"},
    ]
    press = {"kind": "pressure", "face": "top", "pressure": 1e6}
    probes = {"D": (0.0, 0.0, 0.3), "a": (0.0, 0.02, 0.3), "b": (0.0, 0.04, 0.3)}
    weights = [[1.0, ROOT, 1.0]] * 2
    return scene("LE10", surface | {"weights": weights}, 0.6, (210e9, 0.3), supports, [press], probes)


SCENES: dict[str, Callable[..., Scene]] = {
    "elastica": elastica,
    "roll_up": roll_up,
    "corner_load": corner_load,
    "princeton": princeton,
    "cook": cook,
    "thick_plate": thick_plate,
    "tube": rubber.tube,
    "sphere": rubber.sphere,
    "cook_rubber": rubber.cook_rubber,
}


def run(benchmark: str, solver: str, about: dict[str, Any], level: dict[str, Any]) -> dict[str, Any]:
    """Status of a benchmark at one level, and by probe its displacement, [stage][X, Y, Z], and where it began.

    solver: "ancf", "reference", or "bricks" of Cook's membrane of rubber.
    """
    if solver == "bricks":
        from reports.hard_cases.cook_bricks import solve as solve_bricks

        return solve_bricks(**about, **level)
    question = SCENES[benchmark](**about)
    if solver == "ancf":
        from ancf.run import solve

        result = solve(question, AncfLevel(**level))
    else:
        from reference_fe.run import solve

        result = solve(question, ReferenceLevel(**level))
    moves = {probe: result.displacement[:, i].tolist() for i, probe in enumerate(result.probes)}
    places = dict(zip(result.probes, result.probe_position.tolist(), strict=True))
    return {"status": result.status, "moves": moves, "places": places, "unknowns": result.unknowns}
