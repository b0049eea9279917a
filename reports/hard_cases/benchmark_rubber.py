"""Rubber benchmarks as scenes: a tube and a sphere blown up by a pressure that follows, a membrane bent in its plane.

Lengths, moduli and forces are those of the sources. The first two have k = 1000 mu.
"""

from __future__ import annotations

from typing import Any

from compare.exact import sphere_pressure, tube_pressure
from compare.scene import Scene, parse
from reports.hard_cases import shell_surfaces as surfaces

BULK = 1000.0  # of the shear modulus
INNER = 1.0
HOLE = 2.0  # degrees from the pole
MOONEY = (0.4375, 0.0625)  # mu10, mu01 of the sphere's published table; mu = 1
COOK = {"mu10": 0.21125, "bulk_modulus": 2 * 0.4225 * 1.3 / (3 * 0.4)}  # MPa; mu = 0.4225, nu = 0.3


def tube(outer: float, stretch: float) -> Scene:
    """A quarter of a neo-Hooke tube in plane strain, inner radius 1, blown up to `stretch` there."""
    surface = surfaces.swept(surfaces.arc((INNER + outer) / 2, 0.0, 90.0), 2, (0.0, 0.2), first=False)
    supports = [_symmetry("y0", "Y"), _symmetry("y1", "X"), {"kind": "hold", "whole": True, "components": ["Z"]}]
    pressure = tube_pressure(stretch, outer / INNER)
    # along the axis, then along the arc: the normal points inward
    return _blown(surface, outer - INNER, {"mu10": 0.5, "bulk_modulus": BULK}, supports, ("top", pressure), 0.1)


def sphere(outer: float, stretch: float) -> Scene:
    """An octant of a Mooney-Rivlin sphere, inner radius 1, with a hole of HOLE degrees at its pole, blown up."""
    surface = surfaces.revolved(surfaces.arc((INNER + outer) / 2, 0.0, 90.0 - HOLE), 90.0)
    supports = [_symmetry("x0", "Y"), _symmetry("x1", "X"), _symmetry("y0", "Z")]
    pressure = sphere_pressure(stretch, outer / INNER, *MOONEY)
    law = {"mu10": MOONEY[0], "mu01": MOONEY[1], "bulk_modulus": BULK}
    return _blown(surface, outer - INNER, law, supports, ("bottom", pressure), 0.0)


def cook_rubber(faces: str) -> Scene:
    """Cook's membrane of neo-Hooke material, mm and N, thickness 1, force 1.

    faces: "held" (plane strain, as deal.II's gallery describes it) or "free" (a sheet, as its program solves it).
    """
    corners = [[[0.0, 0.0, 0.0], [0.0, 44.0, 0.0]], [[48.0, 44.0, 0.0], [48.0, 60.0, 0.0]]]
    surface = {"kind": "nurbs", "degree": [1, 1], "knots": [[0, 0, 1, 1]] * 2, "control_points": corners}
    flat = [{"kind": "hold", "whole": True, "components": ["Z"]}] if faces == "held" else []
    load = {"kind": "edge", "edge": "x1", "force": [0.0, 1.0, 0.0]}
    probes = {"corner": (1.0, 1.0, 0.0), "middle": (1.0, 0.5, 0.0)}
    return _scene(
        "Cook's membrane of rubber", surface, 1.0, COOK, [{"kind": "clamp", "edge": "x0"}, *flat], load, probes
    )


def _symmetry(edge: str, normal: str) -> dict:
    return {"kind": "symmetry", "edge": edge, "normal": normal}


def _blown(surface: dict, thickness: float, law: dict, supports: list, pressed: tuple[str, float], x: float) -> Scene:
    """A round body under a pressure on its inner face; the probe "inner" is on X. pressed: the face, the pressure."""
    face, pressure = pressed
    load = {"kind": "pressure", "face": face, "pressure": pressure, "follower": True}
    inner = {"inner": (x, 0.0, thickness / 2 if face == "top" else -thickness / 2)}
    return _scene("Blown up", surface, thickness, law, supports, load, inner)


def _scene(title: str, surface: dict, thickness: float, law: dict, supports: list, load: dict, probes: dict) -> Scene:
    """A static scene whose load grows in proportion from 0 to 1."""
    data: dict[str, Any] = {
        "name": "rubber",
        "title": title,
        "surface": surface,
        "thickness": thickness,
        "material": {"kind": "mooney-rivlin", **law},
        "supports": supports,
        "loads": [{"history": [[0.0, 0.0], [1.0, 1.0]], **load}],
        "probes": [{"name": name, "at": list(at)} for name, at in probes.items()],
        "analysis": {"kind": "static"},
        "reference": {"levels": [{"size": 1.0, "time_step": 1.0}]},
    }
    return parse(data, title)
