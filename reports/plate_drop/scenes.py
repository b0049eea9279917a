"""The shipped scenes of the drop with other grooves, heights, grounds and levels."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import compare
from compare.scene import Level, Scene, parse

FOLDER = Path(compare.__file__).parent / "scenes"
SCENES = {"points": "falling_plate", "pressure": "falling_plate_pressure"}
FALL, DEPTH, BOTTOM = 0.04, 0.03, -0.025  # m: height of the fall, depth of the groove, z of the plain face
GROOVE = (0.4, 0.6)
WEIGHT = 9.81  # m/s2


def drop(
    law: str,
    level: dict[str, Any],
    solver: str = "ancf",
    height: float = FALL,
    depth: float = DEPTH,
    grooves: Sequence[Sequence[float]] = (GROOVE,),
    stiffness: float = 1.0,
    ground: dict[str, Any] | None = None,
    **more: Any,
) -> tuple[Scene, Level]:
    """A drop and one level of one solver. stiffness: times that of the scene. ground: keys of its obstacle. more: parts
    of the scene."""
    told = tomllib.loads((FOLDER / f"{SCENES[law]}.toml").read_text(encoding="utf-8"))
    told.pop("companions", None)
    told["grooves"] = [
        told["grooves"][0] | {"name": f"g{i}", "across": list(own), "depth": depth} for i, own in enumerate(grooves)
    ]
    plane = {"shape": {"kind": "plane", "point": [0.0, 0.0, BOTTOM - height]}}
    own_ground = told["obstacles"][0] | plane | (ground or {})
    own_ground["stiffness"] *= stiffness
    centre = next(probe for probe in told["probes"] if probe["name"] == "C")
    centre["at"][2] = BOTTOM + depth
    told["obstacles"] = [own_ground]
    ladders = {name: told.pop(name, {}) for name in ("ancf", "reference")}
    own = {key: value for key, value in ladders[solver].items() if key != "levels"}
    told[solver] = {"levels": [own | level]}
    scene = parse(told | more, f"{SCENES[law]} of the study")
    return scene, getattr(scene, solver).levels[0]


def resting(law: str, level: dict[str, Any], solver: str = "ancf") -> tuple[Scene, Level]:
    """The plate laid on the ground and its weight brought up; two corners keep it from drifting."""
    gravity = {"kind": "gravity", "acceleration": [0.0, 0.0, -WEIGHT], "history": [[0.0, 0.0], [1.0, 1.0]]}
    held = [
        {"kind": "hold", "corner": "x0y0", "components": ["X", "Y"], "over": "middle"},
        {"kind": "hold", "corner": "x1y0", "components": ["Y"], "over": "middle"},
    ]
    static = {"kind": "static", "until": 1.0, "every": 1.0}
    still = level | {"integrator": "trapezoidal"}  # the scene's is for motion
    return drop(law, still, solver, 0.0, ground={"damping": 0.0}, loads=[gravity], supports=held, analysis=static)
