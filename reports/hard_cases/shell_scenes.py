"""The shells and plates as scenes, and the unit that solves one of them at several levels.

A builder takes the fraction of the source's load that acts, small because both solvers are nonlinear, and states
geometry, material, supports, loads and one probe, in the source's own units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from compare.scene import AncfLevel, ReferenceLevel, Scene
from reports.hard_cases import shell_surfaces as surfaces
from reports.hard_cases.benchmark_scenes import scene as stated

CLAMP = {"kind": "clamp", "edge": "x0"}
STEEL_LIKE = (1.0e7, 0.3)


def scene(
    surface: dict,
    thickness: float,
    material: tuple[float, float],
    supports: Sequence[dict],
    loads: Sequence[dict],
    probe: Sequence[float],
) -> Scene:
    """A static scene of one load step with one probe, as `benchmark_scenes.scene`."""
    return stated("Shell", surface, thickness, material, supports, loads, {"P": probe})


def _symmetry(edge: str, normal: str) -> dict:
    return {"kind": "symmetry", "edge": edge, "normal": normal}


def _hold(edge: str, components: str, over: str = "face") -> dict:
    return {"kind": "hold", "edge": edge, "components": list(components), "over": over}


def _simple_support(edge: str, along: str) -> list[dict]:
    """Hard simple support of a flat plate: no deflection, and no turning about the normal of the edge."""
    return [_hold(edge, "Z", "middle"), _hold(edge, along)]


def _point(at: Sequence[float], *force: float) -> dict:
    return {"kind": "point", "at": list(at), "force": list(force)}


def square(load: float, support: str, thickness: float) -> Scene:
    """A quarter of the unit square under the pressure D, so that the deflection is w D / (p L^4)."""
    young, nu = STEEL_LIKE
    press = load * young * thickness**3 / (12 * (1 - nu**2))
    supports = [_symmetry("x1", "X"), _symmetry("y1", "Y")]
    if support == "clamped":
        supports += [CLAMP, {**CLAMP, "edge": "y0"}]
    else:
        supports += _simple_support("x0", "Y") + _simple_support("y0", "X")
    surface = {"kind": "rectangle", "length": 0.5, "width": 0.5}
    load_down = {"kind": "pressure", "face": "top", "pressure": press}
    return scene(surface, thickness, STEEL_LIKE, supports, [load_down], (0.5, 0.5, 0.0))


def annulus(load: float, support: str, thickness: float, hole: float) -> Scene:
    """A quarter of the unit disc with a free hole of that radius under the pressure D; probe on the hole's rim."""
    young, nu = STEEL_LIKE
    press = load * young * thickness**3 / (12 * (1 - nu**2))
    surface = surfaces.revolved(surfaces.line((1.0, 0.0), (hole, 0.0)), 90.0)
    rim = [{**CLAMP, "edge": "y0"}] if support == "clamped" else [_hold("y0", "Z", "middle")]
    supports = [_symmetry("x0", "Y"), _symmetry("x1", "X"), *rim]
    load_down = {"kind": "pressure", "face": "top", "pressure": press}
    return scene(surface, thickness, STEEL_LIKE, supports, [load_down], (0.5, 1.0, 0.0))


def cylinder(load: float, thickness: float = 3.0) -> Scene:
    """An eighth of the pinched cylinder: x along the axis from its middle to a diaphragm, y round to the load.

    R = 300, L = 600, P = 1 on the whole cylinder.
    """
    surface = surfaces.swept(surfaces.arc(300.0, 0.0, 90.0), 1, (0.0, 300.0), first=False)
    supports = [_symmetry("x0", "Y"), _hold("x1", "XZ"), _symmetry("y0", "Z"), _symmetry("y1", "X")]
    pinch = _point((0.0, 1.0), 0.0, 0.0, -load / 4)
    return scene(surface, thickness, (3.0e6, 0.3), supports, [pinch], (0.0, 1.0, 0.0))


def roof(load: float, thickness: float = 0.25) -> Scene:
    """A quarter of the Scordelis-Lo roof: x along its axis from the middle to a diaphragm, y from crown to free edge.

    R = 25, L = 50, 40 degrees each way, weight 90 per area.
    """
    surface = surfaces.swept(surfaces.arc(25.0, 90.0, 50.0), 1, (0.0, 25.0), first=False)
    supports = [_symmetry("x0", "Y"), _hold("x1", "XZ"), _symmetry("y0", "X")]
    weight = {"kind": "patch", "region": [[0.0, 1.0], [0.0, 1.0]], "force": [0.0, 0.0, -load * 90 * _roof_area()]}
    return scene(surface, thickness, (4.32e8, 0.0), supports, [weight], (0.0, 1.0, 0.0))


def _roof_area() -> float:
    return 25.0 * 25.0 * math.radians(40.0)


def hemisphere(load: float, hole: float, thickness: float = 0.04) -> Scene:
    """A quarter of the hemisphere R = 10 with a free hole of `hole` degrees at its pole.

    Two pairs of forces of 2 on the equator: 1 outward along X and 1 inward along Y on the quarter.
    """
    meridian = surfaces.arc(10.0, 0.0, 90.0 - hole)
    top = {"kind": "hold", "corner": "x0y1", "components": ["Z"], "over": "middle"}
    supports = [_symmetry("x0", "Y"), _symmetry("x1", "X"), top]
    forces = [_point((0.0, 0.0), load, 0.0, 0.0), _point((1.0, 0.0), 0.0, -load, 0.0)]
    return scene(surfaces.revolved(meridian, 90.0), thickness, (6.825e7, 0.3), supports, forces, (0.0, 0.0, 0.0))


def twisted(load: float, thickness: float, across: str) -> Scene:
    """The beam twisted by 90 degrees: L = 12, width 1.1, force 1 on its end along the component `across`."""
    force = [load if component == across else 0.0 for component in "XYZ"]
    end = {"kind": "edge", "edge": "x1", "force": force}
    return scene(surfaces.helicoid(12.0, 1.1), thickness, (29.0e6, 0.22), [CLAMP], [end], (1.0, 0.5, 0.0))


def hook(load: float, thickness: float = 2.0) -> Scene:
    """Raasch's hook: R = 14 and 46, width 20, force 1 along the width on its end."""
    end = {"kind": "edge", "edge": "x1", "force": [0.0, 0.0, load]}
    return scene(surfaces.hook((14.0, 46.0), 20.0), thickness, (3300.0, 0.35), [CLAMP], [end], (5.0, 0.5, 0.0))


def straight(load: float, kind: str) -> Scene:
    """MacNeal and Harder's beam 6 x 0.2 x 0.1: unit force on its end, or unit torque, read at the edge of the end."""
    force = {"extension": [load, 0.0, 0.0], "in-plane": [0.0, load, 0.0], "out-of-plane": [0.0, 0.0, load]}
    end = {"kind": "moment", "edge": "x1", "moment": [load, 0.0, 0.0]}
    if kind in force:
        end = {"kind": "edge", "edge": "x1", "force": force[kind]}
    surface, y = {"kind": "rectangle", "length": 6.0, "width": 0.2}, 0.1 if kind in force else 0.2
    return scene(surface, 0.1, STEEL_LIKE, [CLAMP], [end], (6.0, y, 0.0))


SCENES: dict[str, Callable[..., Scene]] = {
    "square": square,
    "annulus": annulus,
    "cylinder": cylinder,
    "roof": roof,
    "hemisphere": hemisphere,
    "twisted": twisted,
    "hook": hook,
    "straight": straight,
}


def solve(shell: str, about: dict[str, Any], solver: str, runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Unit: a shell for each run, {"load": fraction of the source's, "level": of the solver}."""
    return {"runs": [_solve(SCENES[shell](load=run["load"], **about), solver, run) for run in runs]}


def _solve(question: Scene, solver: str, run: dict[str, Any]) -> dict[str, Any]:
    """Status, displacement (X, Y, Z) of the probe over the load, and the number of unknowns."""
    if solver == "ancf":
        from ancf.run import solve as solved

        result = solved(question, AncfLevel(time_step=1.0, **run["level"]))
    else:
        from reference_fe.run import solve as solved

        result = solved(question, ReferenceLevel(time_step=1.0, **run["level"]))
    if result.status != "ok":
        return {"status": result.status, "move": None, "unknowns": result.unknowns}
    move = (result.displacement[-1, 0] / run["load"]).tolist()
    return {"status": "ok", "move": move, "unknowns": result.unknowns}
