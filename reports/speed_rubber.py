"""Units: microseconds per element for the force and the tangent of Mooney-Rivlin plate elements."""

from __future__ import annotations

from typing import Any

import numpy as np

from ancf.material import MooneyRivlin
from ancf.mesh import grid
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, Band
from ancf.system import Body, body
from reports.speed_kernels import AMOUNT, alternate

MESH = (24, 10)  # of the paper's tire
THICKNESS = 0.05
MATERIAL = MooneyRivlin(0.8e6, 0.2e6, 29.6e6)  # k = 14.8 G, as in Table 6
DENSITY = 1100.0
STRETCH = (1.1, 0.95, 1.0)
FOUR = tuple(Band(BOTTOM, GROOVE, 0, (y - 0.03, y + 0.03), 0.02) for y in (0.2, 0.4, 0.6, 0.8))
GROOVES = {"plain": (), "four grooves": FOUR}
ELEMENTS = {"conforming": (3, 3, 2), "enriched": (4, 4, 3)}  # points of each


def plate(element: str, grooves: str, volumetric: str) -> Body:
    """Plate of 2.4 m by 1 m, MESH equal elements."""
    lines = [np.linspace(0.0, length, count + 1) for length, count in zip((2.4, 1.0), MESH, strict=True)]
    mesh = grid(*lines, None, FAMILY[element])
    points = ELEMENTS[element]
    return body(mesh, GROOVES[grooves], THICKNESS, MATERIAL, DENSITY, points, volumetric=volumetric)


def costs(bodies: dict[str, Body], seconds: float) -> dict[str, dict[str, float]]:
    """force_us and tangent_us of bodies by name: least CPU microseconds per element, stretched and disturbed."""
    calls = {}
    for name, made in bodies.items():
        vectors = made.mesh.vectors
        q = vectors * STRETCH + AMOUNT * np.random.default_rng(0).standard_normal(vectors.shape)
        elements, Q = made.elements, q[made.connectivity]
        calls[name, "force_us"] = lambda elements=elements, Q=Q: elements.force(Q)
        calls[name, "tangent_us"] = lambda elements=elements, Q=Q: [None for _ in elements.tangent(Q)]
    found = alternate(calls, seconds)
    count = {name: len(made.connectivity) for name, made in bodies.items()}
    return {
        name: {what: 1e6 * found[name, what].min() / count[name] for what in ("force_us", "tangent_us")}
        for name in bodies
    }


def kernels(seconds: float = 3.0) -> dict[str, Any]:
    """Rows of `costs` by element, way of integrating the volume and grooves."""
    asked = [(e, v, g) for e in ELEMENTS for v in ("relaxed", "reduced", "full") for g in GROOVES]
    bodies = {" ".join(words): plate(words[0], words[2], words[1]) for words in asked}
    found = costs(bodies, seconds)
    return {
        "rows": [
            {
                "element": e,
                "volumetric": v,
                "plate": g,
                "elements": MESH[0] * MESH[1],
                "points": points_per_element(bodies[f"{e} {v} {g}"]),
                **found[f"{e} {v} {g}"],
            }
            for e, v, g in asked
        ]
    }


def points_per_element(made: Body) -> float:
    """Mean number of integration points, those of both rules where there are two."""
    elements = made.elements
    parts = (elements.isochoric, elements.volumetric) if hasattr(elements, "isochoric") else (elements,)
    return float(sum(np.mean([len(part.forms[g].volume) for g in part.form_of]) for part in parts))
