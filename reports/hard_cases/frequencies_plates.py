"""The plates whose natural frequencies the chapter asks for, as scenes."""

from __future__ import annotations

from typing import Any

from compare.scene import Scene, parse

SOLID = "P2 tetrahedron"
# "hard" support, which Kirchhoff's closed form means: the edge's face keeps its Z and does not slide or turn along
# the edge. Where only Z is held, a layer of the thickness softens the edge: 0.2 % of these frequencies at t/a = 1/200.
STRIP = {"length": 1.0, "width": 0.1, "thickness": 0.02, "young": 2.0e6, "density": 2000.0}
SQUARE = {"length": 1.0, "width": 1.0, "thickness": 0.05, "young": 2.0e6, "density": 2000.0}
THIN = {"length": 1.0, "width": 1.0, "thickness": 0.01, "young": 2.1e11, "density": 7850.0, "nu": 0.3}
NAFEMS = {"length": 10.0, "width": 10.0, "young": 2.0e11, "density": 8000.0, "nu": 0.3}
RIB = ((0.01, 0.09, 0.006),)
MIDDLE = ((0.4, 0.6, 0.02),)
PAIR = ((0.2, 0.3, 0.03), (0.7, 0.8, 0.03))
ELEMENTS = ("enriched", "conforming")
COUNT = 6  # modes
PLATES: dict[str, dict[str, Any]] = {
    "strip": {**STRIP, "held": "clamp"},
    "ribbed strip": {**STRIP, "held": "clamp", "grooves": RIB},
    "Barton's cantilever": {**THIN, "held": "clamp"},
    "FV12": {**NAFEMS, "thickness": 0.05},
    "simply supported": {**NAFEMS, "thickness": 0.05, "held": "hard"},
    "FV52": {**NAFEMS, "thickness": 1.0, "held": "bottom"},
    "free plate": SQUARE,
    "free plate, one groove": {**SQUARE, "grooves": MIDDLE},
    "table's cantilever": {**SQUARE, "grooves": PAIR, "held": "clamp"},
}
CROSS = ("free plate", "free plate, one groove", "table's cantilever")  # the two solvers against each other


def scene(plate: str, count: int, nu: float | None = None) -> Scene:
    """The question for the `count` lowest modes of a plate of PLATES, without levels that matter."""
    about = PLATES[plate]
    ratio = about.get("nu", 0.0) if nu is None else nu
    supports = [{"kind": "clamp", "edge": "x0"}] if about.get("held") == "clamp" else []
    edges = {"x0": "Y", "x1": "Y", "y0": "X", "y1": "X"}  # and what runs along each
    if about.get("held") == "hard":
        supports = [{"kind": "hold", "edge": edge, "components": [along, "Z"]} for edge, along in edges.items()]
    if about.get("held") == "bottom":
        supports = [{"kind": "hold", "edge": edge, "components": ["Z"], "over": "bottom"} for edge in edges]
    grooves = [
        {"name": f"g{i}", "face": "bottom", "along": "x", "across": [low, high], "depth": depth}
        for i, (low, high, depth) in enumerate(about.get("grooves", ()))
    ]
    material = {"kind": "svk", "youngs_modulus": about["young"], "poissons_ratio": ratio, "density": about["density"]}
    stated = {
        "name": "plate",
        "title": plate,
        "surface": {"kind": "rectangle", "length": about["length"], "width": about["width"]},
        "thickness": about["thickness"],
        "material": material,
        "grooves": grooves,
        "supports": supports,
        "analysis": {"kind": "modes", "count": count},
        "reference": {"levels": [{"size": about["length"]}]},
    }
    return parse(stated, plate)
