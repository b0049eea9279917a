"""The elements of the integration study: one of 1 x 1 x 0.05 m, 1500 kg/m3, with a groove on its lower face.

The curve of Fig. 4(b) is lost with the figure. Chosen here: the window [0.4, 0.6] of section 7.1, three parts (wall,
floor, wall), walls that are parabolas and meet the floor smoothly, 0.02 m deep.
"""

from __future__ import annotations

from typing import Any

from compare.scene import Scene, load, parse

TREADS = ("rock", "traction", "block", "rib", "smooth")
W = 0.5**0.5
ROUND = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]


def _ellipse(x: float, y: float, a: float, b: float) -> dict[str, Any]:
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    points = [(x + a * p, y + b * q) for p, q in ROUND]
    return {"degree": 2, "knots": knots, "control_points": points, "weights": [1.0, W, 1.0, W, 1.0, W, 1.0, W, 1.0]}


def _polygon(*points: tuple[float, float]) -> dict[str, Any]:
    n = len(points)
    return {"degree": 1, "knots": [0, *range(n + 1), n], "control_points": [*points, points[0]]}


def _profile(points: list[tuple[float, float]], degree: int, knots: list[float], **more: Any) -> dict[str, Any]:
    return {"along": "x", "profile": {"degree": degree, "knots": knots, "control_points": points, **more}}


THIRD = 0.2 / 3
PARABOLIC = [0.4, 0.4 + THIRD / 2, 0.4 + THIRD, 0.5, 0.6 - THIRD, 0.6 - THIRD / 2, 0.6]
DEPTHS = [0.0, 0.02, 0.02, 0.02, 0.02, 0.02, 0.0]
KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 3]
HALF_ROUND = [(0.4, 0), (0.4, 0.02), (0.5, 0.02), (0.6, 0.02), (0.6, 0)]
LEAF = {
    "degree": 2,
    "knots": [0, 0, 0, 1, 2, 2, 3, 4, 4, 4],
    "control_points": [(0.1, 0.3), (0.3, 0.75), (0.6, 0.85), (0.9, 0.6), (0.7, 0.2), (0.4, 0.1), (0.1, 0.3)],
}
BOWL = {
    "degree": [2, 2],
    "knots": [[0, 0, 0, 1, 1, 1]] * 2,
    "depths": [[0.01, 0.01, 0.01], [0.01, 0.03, 0.01], [0.01] * 3],
}

# name: (groove, whether it is polynomial: sections or outlines and depths without weights)
SHAPES: dict[str, tuple[dict[str, Any], bool]] = {
    "Fig. 4": (_profile(list(zip(PARABOLIC, DEPTHS, strict=True)), 2, KNOTS), True),
    "trapezium": (_profile([(0.4, 0), (0.45, 0.02), (0.55, 0.02), (0.6, 0)], 1, [0, 0, 1, 2, 3, 3]), True),
    "half round": (_profile(HALF_ROUND, 2, [0, 0, 0, 1, 1, 2, 2, 2], weights=[1.0, W, 1.0, W, 1.0]), False),
    "slanted bar": ({"outline": _polygon((0.2, -0.1), (0.4, -0.1), (0.8, 1.1), (0.6, 1.1)), "depth": 0.02}, True),
    "leaf": ({"outline": LEAF, "depth": 0.02}, True),
    "elliptic pocket": ({"outline": _ellipse(0.55, 0.45, 0.3, 0.2), "depth": 0.02}, False),
    "leaf with a bowl": ({"outline": LEAF, "depth_surface": BOWL}, True),
}  # fmt: skip
POLYNOMIAL = tuple(name for name, (_, polynomial) in SHAPES.items() if polynomial)
NAMES = (*SHAPES, *(f"{kind} tread" for kind in TREADS))


def scene(name: str) -> Scene:
    """The scene whose element a case is about."""
    if name.removesuffix(" tread") in TREADS:
        return load(f"tread_{name.removesuffix(' tread')}")
    data = load("tread_smooth").model_dump(mode="json", exclude_defaults=True)
    data.pop("tread")
    groove = {"name": name, "face": "bottom", **SHAPES[name][0]}
    return parse({**data, "name": "grooved", "grooves": [groove]}, name)
