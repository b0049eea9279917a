"""Shipped scenes with keys set otherwise or left out: what the tests of scenes are made of."""

import copy
import tomllib
from types import SimpleNamespace

import pytest

from compare.scene import SHIPPED, SceneError, parse

CANTILEVER = (SHIPPED / "cantilever.toml").read_text()
GROOVED = tomllib.loads(CANTILEVER)
CURVED = tomllib.loads((SHIPPED / "cylinder_panel.toml").read_text())
GONE = SimpleNamespace()
W = 0.5**0.5


def changed(changes, base=GROOVED):
    """Plain values of a shipped scene with dotted keys set otherwise or GONE; "end" appends to a list."""
    data = copy.deepcopy(base)
    for key, value in changes.items():
        *path, last = key.split(".")
        place = data
        for step in path:
            place = place[int(step)] if isinstance(place, list) else place[step]
        if value is GONE:
            del place[int(last) if isinstance(place, list) else last]
        elif last == "end":
            place.append(value)
        else:
            place[int(last) if isinstance(place, list) else last] = copy.deepcopy(value)
    return data


def refusals(changes, base=GROOVED):
    with pytest.raises(SceneError) as refused:
        parse(changed(changes, base), "my.toml")
    return refused.value.problems


def band(**more):
    return {"name": "new", "face": "bottom", "along": "x", "across": [0.4, 0.6], "depth": 0.01, **more}


def profile(points=((0.4, 0.0), (0.45, 0.02), (0.6, 0.0)), knots=(0, 0, 0, 1, 1, 1), **more):
    """A band with a curved section of degree 2."""
    curve = {"degree": 2, "control_points": [list(point) for point in points], "knots": list(knots), **more}
    return {"name": "new", "face": "bottom", "along": "x", "profile": curve}


def arched(depth):
    """A semicircle-like section whose greatest depth, at its middle, is `depth`: an ellipse from 0.4 to 0.6."""
    points = [(0.4, 0), (0.4, depth), (0.5, depth), (0.6, depth), (0.6, 0)]
    return profile(points, (0, 0, 0, 1, 1, 2, 2, 2), weights=[1, W, 1, W, 1])


PATH = {
    "analysis.kind": "static",
    "analysis.follow": "arc-length",
    "analysis.every": GONE,
    "reference": GONE,
}
STATIC = {"analysis.kind": "static", "grooves": []}
HOLD = {"kind": "hold", "edge": "x1", "components": ["Z"]}
MOMENT = {"kind": "moment", "edge": "x1", "moment": [0, 1, 0]}
RUBBER = {"kind": "mooney-rivlin", "mu10": 0.8e6, "mu01": 0.2e6, "bulk_modulus": 3e7, "density": 1100.0}
