"""Natural frequencies: closed forms, NAFEMS and Barton, and the two solvers against each other, plain and grooved.

A frequency tests mass and stiffness together. A mode that bends across a groove turns it into a hinge, and how a
hinge deforms inside is what the smooth fields of a plate follow last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from compare.result import Result
from compare.scene import AncfLevel, Level, ReferenceLevel
from reports.hard_cases import frequencies_cases
from reports.hard_cases.chapter import Asked, Chapter, Outcome
from reports.hard_cases.frequencies_plates import COUNT, CROSS, ELEMENTS, SOLID, scene
from reports.timing import least

TITLE = "Natural frequencies"
UNIT = "hard_cases.frequencies."
SIZES = {"quick": (0.2, 0.1), "standard": (0.2, 0.1, 0.05), "full": (0.2, 0.1, 0.05, 0.035)}
MESHES = {"quick": (10,), "standard": (10, 20), "full": (10, 20, 40)}


def units(budget: str) -> list[Asked]:
    """Units of a budget."""
    nus, full = [0.3] if budget == "quick" else [0.0, 0.3], budget != "quick"
    asked = []
    for plate, across in (("strip", 1), ("ribbed strip", 5)):
        asked += [_plates(plate, [[20, across]], 1, [0.0])]
        asked += [_solids(plate, [0.05], 1, [0.0])] * full
    asked += [_plates("Barton's cantilever", [[8, 8]], COUNT, [0.3])]
    asked += [_plates(plate, [[16, 16]], count, [0.3]) for plate, count in (("FV12", COUNT), ("simply supported", 8))]
    asked += [_solids("Barton's cantilever", [0.05], COUNT, [0.3]), _solids("FV52", [2.0, 1.0], 8, [0.3])] * full
    for plate in CROSS:
        asked += [_solids(plate, SIZES[budget], COUNT, nus)]
        asked += [_plates(plate, [[n, n] for n in MESHES[budget]], COUNT, nus)]
    asked += [Asked(UNIT + "steps", {"plates": CROSS, "elements": ELEMENTS, "mesh": [10, 10]})]
    return [*asked, Asked(UNIT + "effort", {"elements": ELEMENTS, "mesh": [16, 16], "count": COUNT})]


def _plates(plate: str, meshes: list[list[int]], count: int, nus: list[float]) -> Asked:
    about = {"plate": plate, "elements": ELEMENTS, "meshes": meshes, "count": count, "nus": nus}
    return Asked(UNIT + "plates", about)


def _solids(plate: str, sizes: Sequence[float], count: int, nus: list[float]) -> Asked:
    return Asked(UNIT + "solids", {"plate": plate, "sizes": list(sizes), "count": count, "nus": nus})


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """The chapter of its outcomes."""
    return frequencies_cases.chapter(outcomes)


def plates(
    plate: str, elements: Sequence[str], meshes: Sequence[Sequence[int]], count: int, nus: Sequence[float]
) -> dict:
    """The ANCF solver with some elements on some meshes, for some Poisson's ratios."""
    from ancf.run import solve

    levels = [AncfLevel(mesh=tuple(mesh), element=element) for element in elements for mesh in meshes]
    return _solved(solve, plate, levels, count, nus)


def solids(plate: str, sizes: Sequence[float], count: int, nus: Sequence[float]) -> dict:
    """The reference on some sizes of tetrahedra, for some Poisson's ratios."""
    from reference_fe.run import solve

    return _solved(solve, plate, [ReferenceLevel(size=size) for size in sizes], count, nus)


def _solved(
    solve: Callable[..., Result], plate: str, levels: Sequence[Level], count: int, nus: Sequence[float]
) -> dict:
    """{"rows": one per Poisson's ratio and level}; "failure" is the result's status."""
    rows = []
    for nu in nus:
        for level in levels:
            found = solve(scene(plate, count, nu), level)
            rows.append(
                {
                    "nu": nu,
                    "element": getattr(level, "element", SOLID),
                    "level": "x".join(map(str, level.mesh)) if hasattr(level, "mesh") else f"h={level.size:g}",
                    "h": found.h,
                    "unknowns": found.unknowns,
                    "frequencies": found.frequencies.tolist(),
                    "rigid": found.facts.get("rigid_modes"),
                    "failure": found.status,
                    "cpu_seconds": found.cpu_seconds,
                }
            )
    return {"rows": rows}


def steps(plates: Sequence[str], elements: Sequence[str], mesh: Sequence[int]) -> dict:
    """Largest stable steps of an explicit integrator, 2 / omega_max (s), and the periods of the first modes (s)."""
    return {"rows": [_step(plate, element, mesh) for plate in plates for element in elements]}


def _step(plate: str, element: str, mesh: Sequence[int]) -> dict:
    from ancf.modes import highest
    from ancf.run import solve
    from ancf.unpack import build

    asked, level = scene(plate, 1, 0.3), AncfLevel(mesh=tuple(mesh), element=element)
    model = build(asked, level)
    return {
        "plate": plate,
        "element": element,
        "mesh": "x".join(map(str, mesh)),
        "seconds": 2 / math.sqrt(highest(model.system)),
        "period": 1 / solve(asked, level).frequencies[0],
        "unknowns": model.system.unknowns,
    }


def effort(elements: Sequence[str], mesh: Sequence[int], count: int) -> dict:
    """CPU time of the modes and of one factorisation, least of five each."""
    return {"rows": [_effort(element, mesh, count) for element in elements]}


def _effort(element: str, mesh: Sequence[int], count: int) -> dict:
    from ancf.linear_solver import LinearSolver
    from ancf.modes import lowest
    from ancf.unpack import build

    system = build(scene("Barton's cantilever", count), AncfLevel(mesh=tuple(mesh), element=element)).system
    stiffness = system.tangent(system.body.mesh.vectors.ravel())
    solver = LinearSolver(system.assembly.pattern)
    factor = least(lambda: solver.factorise(stiffness))
    return {
        "element": element,
        "modes_ms": 1e3 * least(lambda: lowest(system, count, 0.0)),
        "factor_ms": 1e3 * factor,
        "solves": lowest(system, count, 0.0).solves,
        "unknowns": system.unknowns,
    }
