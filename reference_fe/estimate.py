"""About how large a mesh will be, without making it.

Constants were fitted to 42 meshes of plain and grooved plates; they hold within about 20 %,
but a curved section needs up to 2.5 times as many where it is small against the size asked for.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from reference_fe.geometry import Plate
from reference_fe.mesh import Spacing

CELLS = 60
PER_PRISM, PER_CUBE = 8.4, 6.1  # tetrahedra on h x h through the thickness t: one layer, or so many x t / h
PER_EDGE = 4  # tetrahedra more for each edge along a line that the mesh is graded toward
UNKNOWNS = 6.3  # per tetrahedron
PROCESS_MB, ASSEMBLY_KB, FACTOR_KB = 215, 3.2, 0.069  # the last two per unknown and per n^(4/3)


def tetrahedra(plate: Plate, spacing: Spacing) -> int:
    """About how many: area over the squared edge length wished for there, and more along graded lines."""
    x, y = ((np.arange(CELLS) + 0.5) / CELLS * side for side in (plate.length, plate.width))
    x, y = np.meshgrid(x, y, indexing="ij")
    size = np.full(x.shape, spacing.size)
    for ratio, reach, across_x, across_y, _ in spacing.features:
        away = np.hypot(*(np.maximum(0, np.maximum(s[0] - p, p - s[1])) for p, s in ((x, across_x), (y, across_y))))
        size = np.minimum(size, spacing.size * (ratio + (1 - ratio) * np.minimum(away / reach, 1)))
    for ratio, reach, points in spacing.edges:
        away = cKDTree(points[:, :2]).query(np.stack([x, y], axis=-1))[0]
        size = np.minimum(size, spacing.size * (ratio + (1 - ratio) * np.minimum(away / reach, 1)))
    area = plate.length * plate.width / x.size
    inside = np.sum(area / size**2 * np.maximum(PER_PRISM, PER_CUBE * plate.thickness / size))
    along = sum(
        max(np.ptp(sides[0]), np.ptp(sides[1])) / (ratio * spacing.size) for ratio, _, *sides in spacing.features
    )
    for ratio, _, points in spacing.edges:
        along += np.linalg.norm(np.diff(points, axis=0), axis=1).sum() / (ratio * spacing.size)
    return round(float(inside + PER_EDGE * along))


def unknowns(tetrahedra: int) -> int:
    """About how many displacement components that many tetrahedra have."""
    return round(UNKNOWNS * tetrahedra)


def memory_mb(unknowns: int) -> float:
    """About the peak memory (MB) of a solve: the process, tables and pattern, and the factor's n^(4/3)."""
    return PROCESS_MB + (ASSEMBLY_KB * unknowns + FACTOR_KB * unknowns ** (4 / 3)) / 1000
