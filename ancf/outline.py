"""The body's true surface, grooves included, as triangles: for pictures only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from ancf.functional import interpolation
from ancf.mesh import Mesh
from ancf.outline_cut import surface
from ancf.shape import CORNERS
from ancf.subdomain import Feature, Outlined, division, thickness_range

FINEST = 32
INWARD = 1e-7
QUAD = np.array([[0, 1, 2], [0, 2, 3]])
SIDES = ((0, 1), (1, 2), (2, 3), (3, 0))


class Facets(NamedTuple):
    """points (n, 3) in reference coordinates, element of each (n,), triangles (m, 3), element lines (k, 2)."""

    points: np.ndarray
    elements: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray


def rows(mesh: Mesh, facets: Facets) -> sp.csr_matrix:
    """Rows (n, v) of the positions of the facets' points."""
    return interpolation(mesh, facets.elements, facets.points)


def facets(mesh: Mesh, bands: Sequence[Feature], thickness: float) -> Facets:
    """Both faces, the walls of the grooves and the plate's edges.

    The mid-surface is divided at element lines and groove edges and then evenly, about FINEST times a side. Patches
    of one element share the corners where they have one height, and no others: a groove's wall is as sharp as it is,
    and what jumps between elements does.
    """
    if any(isinstance(band, Outlined) for band in bands):
        return _cut_facets(mesh, bands, thickness)
    x, y = (_lines(mesh, bands, axis) for axis in (0, 1))
    nx, ny = len(x) - 1, len(y) - 1
    i, j = (line[..., None] + step for line, step in zip(np.indices((nx, ny)), np.array(CORNERS).T, strict=True))
    xy = np.stack([x[i], y[j]], axis=-1)
    inside = xy + INWARD * (xy.mean(axis=2, keepdims=True) - xy)
    z = thickness_range(bands, thickness, inside[..., 0], inside[..., 1])
    elements = np.repeat(_elements(mesh, xy.mean(axis=2).reshape(-1, 2)), 4)
    chosen, numbers = zip(*(_distinct(elements, i * (ny + 1) + j, z[face]) for face in (1, 0)), strict=True)
    top, bottom = numbers[0], numbers[1] + len(chosen[0])
    faces = (np.column_stack([xy.reshape(-1, 2), z[face].ravel()]) for face in (1, 0))
    points = np.concatenate([own[few] for own, few in zip(faces, chosen, strict=True)])
    quads = [top.reshape(-1, 4), bottom[..., ::-1].reshape(-1, 4), *_walls(top, bottom, z, mesh.closed)]
    triangles = np.concatenate(quads)[:, QUAD].reshape(-1, 3)
    edges = np.concatenate([_edges(face, x, y, mesh) for face in (top, bottom)])
    return Facets(points, np.concatenate([elements[few] for few in chosen]), triangles, edges)


def _distinct(elements: np.ndarray, places: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which corners of patches (n,) stand for all of one element (n,), place and height, and the number (nx, ny, 4) of
    the one that stands for each."""
    where, height = elements * (places.max() + 1) + places.ravel(), z.ravel()
    order = np.lexsort((height, where))
    first = np.concatenate([[True], (np.diff(where[order]) != 0) | (np.diff(height[order]) != 0)])
    number = np.empty(len(order), dtype=int)
    number[order] = np.cumsum(first) - 1
    return order[first], number.reshape(z.shape)


def _cut_facets(mesh: Mesh, bands: Sequence[Feature], thickness: float) -> Facets:
    """As `facets`, where outlines cut the plate."""
    parts = surface(mesh, bands, thickness, FINEST)
    points = np.concatenate([part.reshape(-1, 3) for part in parts])
    middles = np.concatenate([np.repeat(part[..., :2].mean(axis=1), part.shape[1], axis=0) for part in parts])
    flat, walls, lines = np.split(np.arange(len(points)), np.cumsum([part.size // 3 for part in parts])[:2])
    triangles = np.concatenate([flat.reshape(-1, 3), walls.reshape(-1, 4)[:, QUAD].reshape(-1, 3)])
    return Facets(points, _elements(mesh, middles), triangles, lines.reshape(-1, 2))


def _lines(mesh: Mesh, bands: Sequence[Feature], axis: int) -> np.ndarray:
    """Element lines, groove edges and even divisions on one axis."""
    lines = np.unique(np.round(np.concatenate([division(cell, bands)[axis] for cell in mesh.cells]), 12))
    own = (mesh.x_lines, mesh.y_lines)[axis]
    lines = np.union1d(own, [line for line in lines if np.abs(own - line).min() > 1e-9 * np.ptp(own)])
    counts = np.ceil(np.diff(lines) / np.ptp(lines) * FINEST - 1e-9).astype(int)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(lines[:-1], lines[1:], counts, strict=True)]
    return np.concatenate([*parts, lines[-1:]])


def _elements(mesh: Mesh, at: np.ndarray) -> np.ndarray:
    """Element that contains each of the points (n, 2)."""
    number = np.empty((len(mesh.x_lines) - 1, len(mesh.y_lines) - 1), dtype=int)
    number[tuple(mesh.corners.T)] = np.arange(len(mesh.corners))
    column, row = (
        np.clip(np.searchsorted(lines, s) - 1, 0, len(lines) - 2)
        for lines, s in zip((mesh.x_lines, mesh.y_lines), at.T, strict=True)
    )
    return number[column, row]


def _walls(top: np.ndarray, bottom: np.ndarray, z, closed: bool) -> list[np.ndarray]:
    """Upright quadrilaterals: the plate's edges, and wherever two neighbouring patches differ in height."""
    rims = [(np.s_[:, 0], 0, 1), (np.s_[:, -1], 2, 3)]
    rims += [] if closed else [(np.s_[-1], 1, 2), (np.s_[0], 3, 0)]
    quads = [np.stack([top[at][:, b], top[at][:, a], bottom[at][:, a], bottom[at][:, b]], -1) for at, a, b in rims]
    inner = [(np.s_[:-1], np.s_[1:], (2, 1), (3, 0)), (np.s_[:, :-1], np.s_[:, 1:], (3, 2), (0, 1))]
    for number, height, outward in ((top, z[1], 1), (bottom, z[0], -1)):
        for one, other, (a, b), (c, d) in inner:
            apart = np.abs(height[one][..., [a, b]] - height[other][..., [c, d]]).max(axis=-1) > 1e-12
            p, q = number[one][apart], number[other][apart]
            quads.append(np.stack([p[:, a], p[:, b], q[:, d], q[:, c]], axis=-1)[:, ::outward])
    return quads


def _edges(face: np.ndarray, x: np.ndarray, y: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Sides of patches that lie on element lines, as pairs of points (k, 2)."""
    on_x, on_y = np.isin(x, mesh.x_lines), np.isin(y, mesh.y_lines)
    chosen = [face[:, on_y[:-1]], face[on_x[1:]], face[:, on_y[1:]], face[on_x[:-1]]]
    return np.concatenate([part[..., side].reshape(-1, 2) for part, side in zip(chosen, SIDES, strict=True)])
