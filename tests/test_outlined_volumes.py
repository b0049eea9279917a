"""Volume, centroid and inertia of outlined grooves: the rule of the plate solver against the solid that OCC cuts.

The requirement is 1e-6 [tread_volume_error]: OCC itself integrates a body with a cubic wall to 5e-7, others to 1e-9.
"""

import numpy as np
import pytest

from ancf.subdomain import element_rule
from ancf.unpack import bands_of
from compare.scene import load, parse
from reference_fe.geometry import moments, session
from reference_fe.unpack import mid_surface, plate_of

W = 0.5**0.5
SQUARE = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]


def ellipse(x, y, a, b):
    points = [(x + a * p, y + b * q) for p, q in SQUARE]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    return {"degree": 2, "knots": knots, "control_points": points, "weights": [1.0, W, 1.0, W, 1.0, W, 1.0, W, 1.0]}


def polygon(*points):
    n = len(points)
    return {"degree": 1, "knots": [0, *range(n + 1), n], "control_points": [*points, points[0]]}


CUBIC = {
    "degree": 3,
    "knots": [0, 0, 0, 0, 1, 2, 2, 2, 2],
    "control_points": [(0.2, 0.2), (0.9, 0.1), (0.7, 0.9), (0.1, 0.9), (0.2, 0.2)],
}
ELLIPSE = ellipse(0.6, 0.55, 0.25, 0.2)
SLANT = polygon((0.2, -0.1), (0.3, -0.1), (0.9, 1.1), (0.8, 1.1))
BOWL = {
    "degree": [2, 1],
    "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]],
    "depths": [[0.005, 0.01], [0.02, 0.02], [0.01, 0.01]],
}
ROOF = {"degree": [1, 1], "knots": [[0, 0, 1, 1], [0, 0, 0.5, 1, 1]], "depths": [[0.005, 0.02, 0.005]] * 2}
SCENES = {
    "ellipse": {"grooves": [{"outline": ELLIPSE, "depth": 0.03}]},
    "cubic without corners": {"grooves": [{"outline": CUBIC, "depth": 0.03}]},
    "slanted, leaving the plate": {"grooves": [{"outline": SLANT, "depth": 0.02}]},
    "overlapping": {"grooves": [{"outline": SLANT, "depth": 0.02}, {"outline": ELLIPSE, "depth": 0.03}]},
    "bowl": {"grooves": [{"outline": ELLIPSE, "depth_surface": BOWL}]},
    "roof": {"grooves": [{"outline": ELLIPSE, "depth_surface": ROOF}]},
    "lug at the edge": {"protrusions": [{"outline": ellipse(1.0, 0.5, 0.25, 0.2), "depth": 0.03}]},
    "domed lug": {"protrusions": [{"outline": ellipse(0.4, 0.5, 0.25, 0.2), "depth_surface": BOWL}]},
}  # fmt: skip


def scene(shapes):
    data = load("cantilever_plain").model_dump(mode="json", exclude_defaults=True)
    for key in ("published", "sensitivity", "companions", "study"):
        data.pop(key, None)
    named = {
        kind: [{"name": f"{kind} {i}", "face": "bottom", **shape} for i, shape in enumerate(own)]
        for kind, own in shapes.items()
    }
    return parse({**data, **named}, "shapes")


@pytest.mark.parametrize("name", SCENES)
def test_both_solvers_integrate_the_same_solid(name):
    stated = scene(SCENES[name])
    with session() as gmsh:
        volume, centroid, inertia = moments(gmsh, plate_of(stated, *mid_surface(stated)))
    rule = element_rule(((0.0, 1.0), (0.0, 1.0)), bands_of(stated), stated.thickness, (4, 4, 2))
    own = rule.weights.sum()
    centre = rule.weights @ rule.points / own
    away = rule.points - centre
    second = np.einsum("q,qi,qj->ij", rule.weights, away, away)
    assert abs(own / volume - 1) < 1e-6
    assert np.abs(centre - centroid).max() < 1e-6
    assert np.abs(np.trace(second) * np.eye(3) - second - inertia).max() < 1e-6 * np.abs(inertia).max()
