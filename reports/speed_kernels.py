"""Units: microseconds per element for the force and the tangent of the ANCF plate element."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.nurbs import Surface
from ancf.subdomain import BOTTOM, GROOVE, TOP, Band
from ancf.supports import clamp
from ancf.system import Body, body, system

THICKNESS = 0.05
POINTS = (7, 7, 3)
MATERIAL = from_engineering(2.0e6, 0.0)
DENSITY = 2000.0
AMOUNT = 1e-3  # m: size of the random displacement at which kernels are timed
BURST = 3  # calls of a kernel in a row

ONE = (Band(BOTTOM, GROOVE, 0, (0.21, 0.29), 0.03),)
FIVE = tuple(Band(BOTTOM, GROOVE, 0, (y - 0.03, y + 0.03), 0.02) for y in (0.1, 0.3, 0.5, 0.7, 0.9))
CROSSING = FIVE[::2] + tuple(Band(TOP, GROOVE, 1, (x - 0.03, x + 0.03), 0.015) for x in (0.3, 0.7))
GROOVES = {"plain": (), "one groove": ONE, "five grooves": FIVE, "five crossing grooves": CROSSING}


def uniform(mesh: int, grooves: str = "plain") -> Body:
    """Square plate of mesh x mesh equal elements; only grooves make them differ."""
    lines = np.linspace(0.0, 1.0, mesh + 1)
    return body(grid(lines, lines), GROOVES[grooves], THICKNESS, MATERIAL, DENSITY, POINTS)


def graded(mesh: int, pointwise: bool = False) -> Body:
    """Square plate whose elements all differ: sides grow along x and, at another rate, along y."""
    x, y = np.linspace(0.0, 1.0, mesh + 1) ** 1.3, np.linspace(0.0, 1.0, mesh + 1) ** 1.5
    return body(grid(x, y), (), THICKNESS, MATERIAL, DENSITY, POINTS, pointwise=pointwise)


def curved(mesh: int) -> Body:
    """Quarter cylinder of radius 1 m, graded along its axis and its arc: all elements differ."""
    w = 0.5**0.5
    arc = np.array([[-w, w], [0.0, 2 * w], [w, w]])
    points = np.array([[[x, *place] for place in arc] for x in (0.0, 1.0)])
    surface = Surface((1, 2), ([0, 0, 1, 1], [0, 0, 0, 1, 1, 1]), points, [[1, w, 1]] * 2)
    x, y = np.linspace(0.0, 1.0, mesh + 1) ** 1.3, np.linspace(0.0, 1.0, mesh + 1) ** 1.5
    return body(grid(x, y, surface), (), THICKNESS, MATERIAL, DENSITY, POINTS)


def kernels(mesh: int = 16, seconds: float = 3.0) -> dict[str, Any]:
    """Force and tangent of plates of mesh x mesh elements: sharing shapes, alternating, and then all distinct.

    For each plate: its element arrays alone ("force_us", "tangent_us") and the same with the sums into the
    global vector and matrix ("assembled_..."), in CPU microseconds per element; the number of distinct elements
    and the CPU seconds to set it up. "tangent_groove_ratio": the dearer of one and five grooves over plain, the least
    of many calls over the least of many; "median_groove_ratio": the median over rounds, in which all have their turn.
    "product_gflops": the machine's own speed in the same process.
    """
    sharing = {name: (lambda name=name: uniform(mesh, name)) for name in GROOVES}
    distinct = {
        "graded": lambda: graded(mesh),
        "curved and graded": lambda: curved(mesh),
        "graded, point by point": lambda: graded(mesh, pointwise=True),
    }
    rows = _rows(sharing, mesh, seconds)
    for name, make in distinct.items():
        rows += _rows({name: make}, mesh, seconds / 4)
    plates = {row["plate"]: row for row in rows}
    grooved = [plates[name] for name in ("one groove", "five grooves")]
    return {
        "rows": rows,
        "tangent_groove_ratio": max(row["tangent_us"] for row in grooved) / plates["plain"]["tangent_us"],
        "median_groove_ratio": max(row["tangent_ratio"] for row in grooved),
        "product_gflops": _product_gflops(),
    }


def _product_gflops(side: int = 400) -> float:
    """Speed (10^9 operations per CPU second) of a BLAS matrix product here: what the kernels could reach at best."""
    matrix = np.random.default_rng(0).standard_normal((side, side))
    return 2e-9 * side**3 / alternate({"product": lambda: matrix @ matrix}, 0.2)["product"].min()


def growth(mesh: int, seconds: float = 1.0) -> dict[str, Any]:
    """Element force and tangent (CPU microseconds per element) and set-up (s) of plates of mesh x mesh elements."""
    makers = {name: (lambda name=name: uniform(mesh, name)) for name in ("plain", "five grooves")}
    return {"rows": _rows(makers, mesh, seconds, ("force", "tangent"))}


def _rows(makers: dict[str, Callable[[], Body]], mesh: int, seconds: float, what=None) -> list[dict[str, Any]]:
    """One row per plate; their kernels alternate. "tangent_ratio": median over rounds of tangent over the first's."""
    rows, calls = [], {}
    for name, make in makers.items():
        begin = time.process_time()
        plate = make()
        setup = time.process_time() - begin
        rows.append({"plate": name, "mesh": mesh, "elements": mesh**2, "distinct": plate.shapes})
        rows[-1]["setup_seconds"] = setup
        calls |= {(name, kind): call for kind, call in _calls(plate, what or WHAT).items()}
    found = alternate(calls, seconds)
    for row in rows:
        for kind in what or WHAT:
            row[f"{kind}_us"] = 1e6 * found[row["plate"], kind].min() / mesh**2
        first = found[rows[0]["plate"], "tangent"]
        row["tangent_ratio"] = float(np.median(found[row["plate"], "tangent"] / first))
    return rows


WHAT = ("force", "tangent", "assembled_force", "assembled_tangent")


def _calls(plate: Body, what: Sequence[str]) -> dict[str, Callable[[], Any]]:
    """What is timed, at one deformed configuration of a plate clamped at one edge."""
    Q, q = _deformed(plate), _displaced(plate).ravel()
    calls = {"force": lambda: plate.elements.force(Q), "tangent": lambda: _spend(plate, Q)}
    if set(what) - set(calls):
        acting = system(plate, clamp(plate.mesh, "x0", "all"), (), THICKNESS)
        calls["assembled_force"] = lambda: acting.force_internal(q)
        calls["assembled_tangent"] = lambda: acting.tangent(q)
    return {name: calls[name] for name in what}


def _displaced(plate: Body) -> np.ndarray:
    """Nodal vectors (v, 3) near the undeformed ones."""
    vectors = plate.mesh.vectors
    return vectors + AMOUNT * np.random.default_rng(0).standard_normal(vectors.shape)


def _deformed(plate: Body) -> np.ndarray:
    """Nodal vectors by element (e, i, 3)."""
    return _displaced(plate)[plate.connectivity]


def _spend(plate: Body, Q: np.ndarray) -> None:
    """All element tangents, span by span."""
    for _ in plate.elements.tangent(Q):
        pass


def alternate(calls: dict[Any, Callable[[], Any]], seconds: float) -> dict[Any, np.ndarray]:
    """Least CPU time (s) of each call in each round (n,): all have their turn, round after round, for `seconds`.

    In its turn a call is made BURST times in a row, as Newton's method does. The least of all rounds is what
    a call costs undisturbed; ratios are taken within rounds, where what disturbs one call disturbs its neighbours.
    """
    rounds: dict[Any, list[float]] = {name: [] for name in calls}
    end = time.perf_counter() + seconds
    while len(next(iter(rounds.values()))) < 2 or time.perf_counter() < end:
        for name, call in calls.items():
            least = np.inf
            for _ in range(BURST):
                begin = time.process_time()
                call()
                least = min(least, time.process_time() - begin)
            rounds[name].append(least)
    return {name: np.array(found) for name, found in rounds.items()}
