"""Linear functionals of the position field: its value at a point, its mean over a line, a face, a region.

A functional is a row (v,) over the nodal vectors: position = row @ vectors. A dead force F spread in
the same way is the generalised force row x F (virtual work).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from ancf.element import integrand
from ancf.mesh import Mesh
from ancf.quadrature import NO_PROMISE, Rule, gauss, join, onto_cell, tensor
from ancf.subdomain import Feature, division_of_side, element_rule, thickness_range, through_thickness

POINTS = (5, 5, 3)
BLOCK = 2048  # points evaluated at a time
ROUND_OFF = 1e-12


def interpolation(mesh: Mesh, elements: np.ndarray, points: np.ndarray) -> sp.csr_matrix:
    """Rows (n, v) of the positions at the reference coordinates points (n, 3), each in its element (n,)."""
    cells = np.array(mesh.cells)
    values = []
    for start in range(0, len(points), BLOCK):
        cell = cells[elements[start : start + BLOCK]]
        local = points[start : start + BLOCK].astype(float)
        local[:, :2] -= cell[:, :, 0]
        values.append(mesh.shape.values(local, tuple((cell[:, :, 1] - cell[:, :, 0]).T)).ravel())
    columns = mesh.connectivity[elements]
    ends = np.arange(len(points) + 1) * columns.shape[1]
    rows = sp.csr_matrix((np.concatenate(values), columns.ravel(), ends), shape=(len(points), len(mesh.vectors)))
    for e in np.intersect1d(elements, list(mesh.special)):
        rows += _special_rows(mesh, e, elements == e, points)
    return rows


def _special_rows(mesh: Mesh, e: int, own: np.ndarray, points: np.ndarray) -> sp.csr_matrix:
    """What the functions that a special element has besides the mesh's shape add at its own points."""
    (x0, x1), (y0, y1) = mesh.cells[e]
    shape, vectors = mesh.special[e]
    base = mesh.connectivity.shape[1]
    S = shape.evaluate(points[own] - (x0, y0, 0.0), (x1 - x0, y1 - y0)).S[:, base:]
    rows, columns = np.repeat(np.flatnonzero(own), S.shape[1]), np.tile(vectors[base:], len(S))
    return sp.csr_matrix((S.ravel(), (rows, columns)), shape=(len(points), len(mesh.vectors)))


def value_at(mesh: Mesh, x: float, y: float, z: float) -> np.ndarray:
    """Row (v,) of the position at the reference coordinates (x, y, z). Raises ValueError beside the plate."""
    return interpolation(mesh, np.array([mesh.locate(x, y)]), np.array([[x, y, z]])).toarray()[0]


def mean_through_thickness(mesh: Mesh, bands: Sequence[Feature], thickness: float, x: float, y: float) -> np.ndarray:
    """Row (v,) of the mean position over the material line through (x, y)."""
    e = mesh.locate(x, y)
    z_min, z_max = thickness_range(bands, thickness, *mesh.inward(x, y))
    place = Rule(np.array([[x, y]]), np.array([1 / float(z_max - z_min)]), NO_PROMISE)
    line = through_thickness(place, z_min, z_max, POINTS[2], mesh.levels(e))
    return line.weights @ interpolation(mesh, np.full(len(line.weights), e), line.points)


def mean_over_region(mesh: Mesh, bands: Sequence[Feature], thickness: float, region) -> np.ndarray:
    """Row (v,) of the mean position over the material whose (x, y) lies in the region ((x0, x1), (y0, y1)).

    Raises ValueError where the region misses the plate.
    """
    row, volume = np.zeros(len(mesh.vectors)), 0.0
    for e, cell in enumerate(mesh.cells):
        part = tuple((max(c[0], r[0]), min(c[1], r[1])) for c, r in zip(cell, region, strict=True))
        if all(high - low > 1e-12 * (c[1] - c[0]) for (low, high), c in zip(part, cell, strict=True)):
            rule = element_rule(part, bands, thickness, POINTS, levels=mesh.levels(e))
            piece, amount = _volume_row(mesh, e, rule)
            row += piece
            volume += amount
    if volume == 0:
        raise ValueError(f"the region {region} misses the plate")
    return row / volume


def mean_over_edge(mesh: Mesh, bands: Sequence[Feature], thickness: float, edge: str) -> np.ndarray:
    """Row (v,) of the mean position over the material face of the edge x0, x1, y0 or y1."""
    row, area = _over_edge(mesh, bands, thickness, edge, 0)
    return row / area


def slope_through_edge(mesh: Mesh, bands: Sequence[Feature], thickness: float, edge: str) -> np.ndarray:
    """Row (v,) of the mean slope of the position along z over the face of an edge: its director.

    Integral of (z - z0) r over that of (z - z0)^2, z0 the face's mean z: the slope of the best straight line.
    """
    (row, area), (row_z, first), (_, second) = (_over_edge(mesh, bands, thickness, edge, power) for power in range(3))
    centre = first / area
    slope = (row_z - centre * row) / (second - centre * first)
    slope[np.abs(slope) < ROUND_OFF * np.abs(slope).max()] = 0.0
    return slope


def _over_edge(mesh: Mesh, bands, thickness: float, edge: str, power: int) -> tuple[np.ndarray, float]:
    """Integrals of z^power S as a row (v,) and of z^power over the material face of an edge, by area."""
    axis = "xy".index(edge[0])
    at = (mesh.x_lines, mesh.y_lines)[axis][0 if edge[1] == "0" else -1]
    row, total = np.zeros(len(mesh.vectors)), 0.0
    for e, cell in enumerate(mesh.cells):
        if at in cell[axis]:
            rule = _face_rule(cell, bands, thickness, axis, float(at), mesh.levels(e))
            piece, amount = _area_row(mesh, e, rule, axis, rule.points[:, 2] ** power)
            row += piece
            total += amount
    return row, total


def pressure_on_face(mesh: Mesh, thickness: float, face: int) -> np.ndarray:
    """Integral (v, 3) of S times the inward normal over the face z = face thickness / 2, by area, face = -1 or 1."""
    row, rule = np.zeros((len(mesh.vectors), 3)), tensor(gauss(POINTS[0]), gauss(POINTS[1]))
    for e, cell in enumerate(mesh.cells):
        (x0, x1), (y0, y1) = cell
        own = join(*(onto_cell(rule, part) for part in mesh.parts(e)))
        points = np.column_stack([own.points - (x0, y0), np.full(len(own.weights), face * thickness / 2)])
        shape, vectors = mesh.element(e)
        S, S_p = shape.evaluate(points, (x1 - x0, y1 - y0))
        J = np.einsum("ic,qip->qpc", mesh.vectors[vectors], S_p)
        np.add.at(row, vectors, -face * S.T @ (own.weights[:, None] * np.cross(J[:, 0], J[:, 1])))
    return row


def _face_rule(cell, bands, thickness: float, axis: int, at: float, levels: Sequence[float]) -> Rule:
    """Rule over the face of a cell at a constant coordinate: its weights are d(other coordinate) dz."""
    lines, beside = division_of_side(cell, bands, axis, at)
    across = gauss(POINTS[0])
    half = np.diff(lines)[:, None] / 2
    s = (lines[:-1, None] + half * (1 + across.points[:, 0])).ravel()
    x, y = (np.full_like(s, at), s) if axis == 0 else (s, np.full_like(s, at))
    line = Rule(np.column_stack([x, y]), (half * across.weights).ravel(), across.degree)
    place = (np.full_like(s, beside), s) if axis == 0 else (s, np.full_like(s, beside))
    return through_thickness(line, *thickness_range(bands, thickness, *place), POINTS[2], levels)


def _volume_row(mesh: Mesh, e: int, rule: Rule) -> tuple[np.ndarray, float]:
    """Integral of the shape functions of element e by volume as a row (v,), and the volume."""
    shape, vectors = mesh.element(e)
    part = integrand(shape, rule, mesh.cells[e], mesh.vectors[vectors], enhanced=False)
    row = np.zeros(len(mesh.vectors))
    row[vectors] = part.volume @ part.S
    return row, float(part.volume.sum())


def _area_row(mesh: Mesh, e: int, rule: Rule, axis: int, weight: np.ndarray) -> tuple[np.ndarray, float]:
    """Integrals of weight (q,) x S as a row (v,) and of the weight over a face of element e with constant `axis`."""
    (x0, x1), (y0, y1) = mesh.cells[e]
    shape, vectors = mesh.element(e)
    S, S_p = shape.evaluate(rule.points - (x0, y0, 0.0), (x1 - x0, y1 - y0))
    J = np.einsum("ic,qip->qpc", mesh.vectors[vectors], S_p)
    weights = weight * rule.weights * np.linalg.norm(np.cross(J[:, 1 - axis], J[:, 2]), axis=1)
    row = np.zeros(len(mesh.vectors))
    row[vectors] = weights @ S
    return row, float(weights.sum())
