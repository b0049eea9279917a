"""What a revolved mid-surface may not say, and where its edges lie."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from compare.scene import TURN, Interval, Revolved, Scene

LEAST_AROUND = 3  # elements on a full turn: fewer would meet a neighbour on two sides


def revolved_problems(surface: Revolved) -> Iterator[str]:
    """Problems of the angle and of the section's points; its knots are checked elsewhere."""
    low, high = surface.angle
    if not low < high:
        yield f"surface.angle = [{low:g}, {high:g}]: the first angle must be less than the second"
    elif high - low > 2 * math.pi + TURN:
        yield f"surface.angle = [{low:g}, {high:g}]: more than a full turn, 2 pi, overlaps itself"
    section = surface.section
    for i, (_, radius) in enumerate(section.control_points):
        if not radius > 0:
            key = f"surface.section.control_points.{i}.1 = {radius:g}"
            yield f"{key}: a section on the axis or beyond it has no surface there; state a radius greater than 0"
    if section.weights is not None and len(section.weights) != len(section.control_points):
        count = len(section.control_points)
        yield f"surface.section.weights = {list(section.weights)}: {count} control points need as many weights"


def seam_problems(scene: Scene) -> Iterator[str]:
    """What a scene asks of the edges x0 and x1 where a full turn leaves none, and what lies across the seam."""
    if not scene.surface.closed:
        return
    reason = "a full turn is closed there and has no such edge"
    for kind in ("supports", "loads"):
        for i, part in enumerate(getattr(scene, kind)):
            for key in ("edge", "corner"):
                place = getattr(part, key, None)
                if place is not None and place.startswith("x"):
                    yield f"{kind}.{i}.{key} = {place!r}: {reason}"
    for kind in ("loads", "probes"):
        for i, part in enumerate(getattr(scene, kind)):
            if hasattr(part, "region"):
                yield from _over_seam(scene, f"{kind}.{i}.region", part.region[0])
    for i, level in enumerate(scene.ladder("ancf")):
        if level.mesh[0] < LEAST_AROUND:
            key = f"ancf.levels.{i}.mesh.0 = {level.mesh[0]}"
            yield f"{key}: a full turn needs {LEAST_AROUND} elements at least, each with two neighbours"


def _over_seam(scene: Scene, key: str, interval: Interval) -> Iterator[str]:
    """A range of angles that only begins or only ends within those of the full turn."""
    (low, high), (first, last) = interval, scene.surface.angle
    if low < last and high > first and not (first - TURN <= low and high <= last + TURN):
        reason = f"reaches across the seam of a full turn from {first:g} to {last:g}"
        yield f"{key}.0 = [{low:g}, {high:g}]: {reason}; state surface.angle from another angle on"


def edge_of_ring(surface: Revolved, edge: str, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of an edge, and both derivatives there, across it and along it: (samples, 3) each."""
    along = surface.span["xy".index(edge[0]) - 1]
    at = np.linspace(*along, samples)
    end = surface.span["xy".index(edge[0])][int(edge[1])]
    angle, u = (np.full(samples, end), at) if edge[0] == "x" else (at, np.full(samples, end))
    (a, r), (a_u, r_u) = section_curve(surface, u)
    axis, out, around = (np.roll(np.eye(3), -"XYZ".index(surface.axis), axis=0)[k] for k in range(3))
    b = np.cos(angle)[:, None] * out + np.sin(angle)[:, None] * around
    t = np.cos(angle)[:, None] * around - np.sin(angle)[:, None] * out
    S = a[:, None] * axis + r[:, None] * b
    S_x, S_y = r[:, None] * t, a_u[:, None] * axis + r_u[:, None] * b
    return (S, S_x, S_y) if edge[0] == "x" else (S, S_y, S_x)


def section_curve(surface: Revolved, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The section's (along, radius) and their derivatives at u (k,): (2, k) each."""
    from scipy.interpolate import BSpline

    section = surface.section
    points = np.array(section.control_points)
    weights = np.ones(len(points)) if section.weights is None else np.array(section.weights)
    spline = BSpline(section.knots, np.column_stack([points * weights[:, None], weights]), section.degree)
    value, slope = spline(u).T, spline(u, nu=1).T
    c = value[:2] / value[2]
    return c, (slope[:2] - slope[2] * c) / value[2]
