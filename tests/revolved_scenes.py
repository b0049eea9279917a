"""Rings and a torus as scenes, and what is known of them in closed form."""

import math

from compare.scene import Scene, parse

TURN = [0.0, 2 * math.pi]
THICKNESS, RADIUS, TUBE, HALF = 0.1, 1.0, 0.4, 1.0  # torus: of the wall, of the ring, of the tube, half its angle


def cylinder(radius: float, width: float) -> dict:
    """A straight section parallel to the axis."""
    points = [[-width / 2, radius], [width / 2, radius]]
    return {"degree": 1, "knots": [0, 0, 1, 1], "control_points": points}


def arc() -> dict:
    """The outer arc of a torus' tube from -HALF to HALF (rad): one rational piece of degree 2."""
    s, c = math.sin(HALF), math.cos(HALF)
    points = [[-TUBE * s, RADIUS + TUBE * c], [0.0, RADIUS + TUBE / c], [TUBE * s, RADIUS + TUBE * c]]
    return {"degree": 2, "knots": [0, 0, 0, 1, 1, 1], "control_points": points, "weights": [1, c, 1]}


def arc_volume(angle: float = 2 * math.pi, depth: float = 0.0, part: float = 0.0) -> float:
    """Volume (m3) of the torus' wall turned by an angle, by Pappus: area of its section times its centroid's path.

    A ring sector of the angle 2 b between the radii c and d has the area b (d^2 - c^2) and, about the centre of the
    tube, the moment 2 sin b (d^3 - c^3) / 3. depth: of a groove in the outer face between the angles -part and part.
    """
    inner, outer = TUBE - THICKNESS / 2, TUBE + THICKNESS / 2

    def sector(b: float, c: float, d: float) -> float:
        return RADIUS * b * (d**2 - c**2) + 2 * math.sin(b) * (d**3 - c**3) / 3

    return angle * (sector(HALF, inner, outer) - sector(part, outer - depth, outer))


def scene_of(section: dict, angle=TURN, **more) -> Scene:
    """A revolved scene of soft rubber about Y: modes of both solvers, where `more` says nothing else."""
    data = {
        "name": "ring",
        "title": "Ring",
        "surface": {"kind": "revolved", "axis": "Y", "angle": list(angle), "section": section},
        "thickness": THICKNESS,
        "material": {"kind": "svk", "youngs_modulus": 2e6, "poissons_ratio": 0.3, "density": 1000.0},
        "analysis": {"kind": "modes", "count": 6},
        "ancf": {"levels": [{"mesh": [12, 4]}]},
        "reference": {"levels": [{"size": 0.4}]},
    }
    return parse({**data, **more}, "ring.toml")


def first(scene: Scene, solver: str):
    """The first level of a solver's ladder."""
    return scene.ladder(solver)[0]
