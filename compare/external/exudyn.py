"""Exudyn: its thin ANCF plate (ObjectANCFThinPlate, nine coordinates a node) as a clamped square under a corner force.

A Kirchhoff plate is stiffer than a solid, so its answer differs; it is here for what it costs. PyPI package
exudyn; implicit trapezoidal rule, modified Newton, sparse solver, one thread.
"""

from __future__ import annotations

import importlib.util
import time
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Answer:
    """Deflection (m) of the loaded corner along z at the end, and the CPU seconds of the time steps alone."""

    deflection: float
    cpu_seconds: float


def available() -> bool:
    """Whether the package is installed."""
    return importlib.util.find_spec("exudyn") is not None


def cantilever(
    mesh: int, steps: int, side: float, thickness: float, young: float, poisson: float, density: float, force: float
) -> Answer:
    """Square plate of mesh x mesh elements, clamped at x = 0, corner force along z ramped over 1 s in equal steps.

    Lengths in m, Pa, kg/m3, N. Raises ImportError where exudyn is absent, RuntimeError where its solver fails.
    """
    import exudyn
    from exudyn import itemInterface as item

    container = exudyn.SystemContainer()
    plate = container.AddSystem()
    nodes = _plate(plate, item, mesh, side, thickness, young, poisson, density)
    _clamp(plate, item, nodes[: mesh + 1])
    corner = plate.AddMarker(item.MarkerNodePosition(nodeNumber=nodes[-1]))
    load = item.Force(
        markerNumber=corner, loadVector=[0, 0, 0], loadVectorUserFunction=lambda _, t, __: [0, 0, force * t]
    )
    plate.AddLoad(load)
    plate.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    settings.solution.file.write = False
    begin = time.process_time()
    if plate.SolveDynamic(settings) is False:
        raise RuntimeError("exudyn found no solution")
    cpu = time.process_time() - begin
    moved = plate.GetNodeOutput(nodes[-1], exudyn.OutputVariableType.Displacement)
    return Answer(float(moved[2]), cpu)


def _plate(plate, item, mesh: int, side: float, thickness: float, young: float, poisson: float, density: float) -> list:
    """Nodes, line by line from x = 0, and elements between them; returns the nodes."""
    at = np.linspace(0.0, side, mesh + 1)
    nodes = [
        plate.AddNode(item.NodePointSlope12(referenceCoordinates=[x, y, 0, 1, 0, 0, 0, 1, 0])) for x in at for y in at
    ]
    law = young / (1 - poisson**2) * np.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    for i in range(mesh):
        for j in range(mesh):
            first = i * (mesh + 1) + j
            corners = [first, first + mesh + 1, first + mesh + 2, first + 1]
            element = item.ObjectANCFThinPlate(
                nodeNumbers=[nodes[corner] for corner in corners],
                thickness=thickness,
                density=density,
                strainCoefficients=_matrices(law * thickness),
                curvatureCoefficients=_matrices(law * thickness**3 / 12),
            )
            plate.AddObject(element)
    return nodes


def _matrices(matrix: np.ndarray):
    import exudyn

    made = exudyn.Matrix3DList()
    made.Append(matrix)
    return made


def _clamp(plate, item, nodes: list) -> None:
    """Hold all nine coordinates of the nodes."""
    ground = plate.AddNode(item.NodePointGround())
    fixed = plate.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for node in nodes:
        for coordinate in range(9):
            held = plate.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
            plate.AddObject(item.CoordinateConstraint(markerNumbers=[fixed, held]))
