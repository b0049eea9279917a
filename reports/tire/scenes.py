"""The shipped scene of the tire with other grounds, falls, grooves and levels, and its whole and its half."""

from __future__ import annotations

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import compare
from compare.scene import Level, Scene, parse

FILE = Path(compare.__file__).parent / "scenes" / "falling_tire.toml"
TREAD = -1.3145  # m: Z of the tread's lowest points
FALL = 0.02  # m
WEIGHT = 9.81  # m/s2
PER_POINT = {"law": "points", "stiffness": 7.0e4, "damping": 160.0}  # Table 7
SHARE = {"quarter": 4, "half": 2, "whole": 1}  # parts that make the tire


def stated() -> dict[str, Any]:
    """The shipped scene as plain values."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def tire(
    level: dict[str, Any],
    solver: str = "ancf",
    part: str = "quarter",
    height: float = FALL,
    until: float | None = None,
    ground: dict[str, Any] | None = None,
    stiffness: float = 1.0,
    bulk: float = 1.0,
    depth: float | None = None,
    **more: Any,
) -> tuple[Scene, Level]:
    """A fall of the tire or a part of it, and one level of one solver.

    stiffness: times the ground's. bulk: times the bulk modulus. depth: of the grooves (m). ground: keys of the
    obstacle. more: parts of the scene. A level's own keys join those that its ladder states for all.
    """
    told = stated()
    own = told["obstacles"][0] | {"shape": {"kind": "plane", "point": [0.0, 0.0, TREAD - height]}} | (ground or {})
    own["stiffness"] *= stiffness
    told["obstacles"] = [own]
    told["material"]["bulk_modulus"] *= bulk
    if until is not None:
        told["analysis"]["until"] = until
    if depth is not None:
        for groove in told["grooves"]:
            groove["profile"]["control_points"] = [[y, depth if d else 0.0] for y, d in points_of(groove)]
    ladders = {name: told.pop(name, {}) for name in ("ancf", "reference")}
    common = {key: value for key, value in ladders[solver].items() if key != "levels"}
    if solver == "ancf":
        level = level | {"mesh": mesh_of(level["mesh"], part)}
    told[solver] = {"levels": [common | level]}
    scene = parse(PARTS[part](told) | more, f"tire, {part}")
    return scene, getattr(scene, solver).levels[0]


def points_of(groove: dict[str, Any]) -> list[list[float]]:
    """Control points of a groove's profile."""
    return groove["profile"]["control_points"]


def mesh_of(mesh: list[int], part: str) -> list[int]:
    """The quarter's mesh on a larger part: as many elements more as there is more tire."""
    return {"quarter": mesh, "half": [mesh[0], 2 * mesh[1]], "whole": [2 * mesh[0], 2 * mesh[1]]}[part]


def _half(told: dict[str, Any]) -> dict[str, Any]:
    """The quarter and its mirror image in Y = 0: the section runs from bead to bead."""
    told = copy.deepcopy(told)
    section = told["surface"]["section"]
    degree, points = section["degree"], section["control_points"]
    mirrored = [[-along, radius] for along, radius in points[:0:-1]]
    inner = section["knots"][degree + 1 :]
    section["control_points"] = mirrored + points
    section["knots"] = [-knot for knot in reversed(inner)] + [0.0] * degree + inner
    told["grooves"] += [_mirrored(groove) for groove in told["grooves"]]
    told["supports"] = [support for support in told["supports"] if support["edge"] != "y0"]
    return told


def _mirrored(groove: dict[str, Any]) -> dict[str, Any]:
    profile = groove["profile"]
    last = profile["knots"][-1]
    own = {
        "control_points": [[-y, depth] for y, depth in reversed(points_of(groove))],
        "knots": [last - knot for knot in reversed(profile["knots"])],
    }
    return groove | {"name": f"{groove['name']}, other side", "profile": profile | own}


def _whole(told: dict[str, Any]) -> dict[str, Any]:
    """The half turned all the way around: a closed ring without supports."""
    told = _half(told)
    told["surface"]["angle"] = [0.0, 2 * math.pi]
    told["supports"] = []
    return told


PARTS = {"quarter": lambda told: told, "half": _half, "whole": _whole}
