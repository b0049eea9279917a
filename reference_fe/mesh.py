"""Second-order tetrahedra on the grooved solid: gmsh meshes the box, scikit-fem holds the mesh.

On a NURBS mid-surface every node of the box mesh is carried to X = S(x, y) + z n(x, y); S and its
derivatives are evaluated by OCC (through gmsh). The tetrahedra are isoparametric there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
from skfem import Basis, ElementTetP2, MeshTet2

from reference_fe.geometry import MeshError, Plate, build, session

TO_SKFEM = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # gmsh's tetra10 has its last two edges the other way round


@dataclass(frozen=True)
class Surface:
    """NURBS mid-surface (paper Eq. 4): points (n, m, 3) in m, weights (n, m), flat knots of each direction."""

    degree: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    points: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True)
class Solid:
    """A checked mesh. mesh: scikit-fem tetrahedra in space (m). box: the same tetrahedra in the box (m).

    exact_volume is the solid's own (m3); volume the mesh's. Node numbers are those of scikit-fem's
    scalar P2 element: vertices first, then edges.
    """

    mesh: MeshTet2
    box: MeshTet2
    volume: float
    exact_volume: float
    smallest_jacobian: float
    flat: bool

    @property
    def tetrahedra(self) -> int:
        """Number of tetrahedra."""
        return self.mesh.t.shape[1]

    @property
    def extent(self) -> float:
        """Longest side of the box (m)."""
        return float(np.ptp(self.box.p, axis=1).max())


@dataclass(frozen=True)
class Spacing:
    """Edge length (m): `size` far away, `ratio` x size inside a feature's box, linear over `reach` (m) between.

    features: (ratio, reach, (x0, x1), (y0, y1), (z0, z1)) each.
    """

    size: float
    features: tuple[tuple[float, float, tuple[float, float], tuple[float, float], tuple[float, float]], ...] = ()


def make(plate: Plate, spacing: Spacing, surface: Surface | None = None, folder: Path | None = None) -> Solid:
    """Build, mesh, map and check the solid; store it as plate.vtu under `folder` if given.

    Raises MeshError with the status "gmsh_missing", "gmsh_busy", "geometry_failed", "mesh_failed",
    "mesh_inverted" (a Jacobian is not positive) or "mesh_volume" (the mesh misses the exact volume).
    """
    with session() as gmsh:
        exact = build(gmsh, plate)
        points, tetrahedra = _tetrahedralise(gmsh, spacing)
    mesh = MeshTet2(points.T, tetrahedra[:, TO_SKFEM].T)
    solid = _checked(mesh, mesh, exact, flat=True)
    return solid


def _tetrahedralise(gmsh: ModuleType, spacing: Spacing) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and second-order tetrahedra (m, 10) of the current model, in gmsh's node order."""
    option, field = gmsh.option.setNumber, gmsh.model.mesh.field
    for name in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        option(f"Mesh.{name}", 0)
    option("Mesh.MeshSizeMax", spacing.size)
    boxes = []
    for ratio, reach, *sides in spacing.features:
        boxes.append(field.add("Box"))
        numbers = {"VIn": ratio * spacing.size, "VOut": spacing.size, "Thickness": reach}
        for axis, side in zip("XYZ", sides, strict=True):
            numbers |= {f"{axis}Min": side[0], f"{axis}Max": side[1]}
        for name, value in numbers.items():
            field.setNumber(boxes[-1], name, value)
    if boxes:
        least = field.add("Min")
        field.setNumbers(least, "FieldsList", boxes)
        field.setAsBackgroundMesh(least)
    try:
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
    except Exception as error:
        raise MeshError("mesh_failed", f"gmsh: {error}") from error
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    index = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    index[tags] = np.arange(tags.size)
    _, nodes = gmsh.model.mesh.getElementsByType(11)
    if nodes.size == 0:
        raise MeshError("mesh_failed", "gmsh made no tetrahedra")
    used, tetrahedra = np.unique(index[nodes], return_inverse=True)
    return coordinates.reshape(-1, 3)[used], tetrahedra.reshape(-1, 10)


def _checked(mesh: MeshTet2, box: MeshTet2, exact: float, flat: bool) -> Solid:
    """The Solid, or a MeshError where a Jacobian is not positive or the volume is off by more than 1 %."""
    basis = Basis(mesh, ElementTetP2(), intorder=4)
    jacobian = basis.mapping.detDF(basis.X)
    smallest = float(jacobian.min())
    if not smallest > 0:
        raise MeshError("mesh_inverted", f"smallest Jacobian {smallest:.3g} m3: a tetrahedron is inverted")
    volume = float(basis.dx.sum())
    if not abs(volume - exact) < 0.01 * exact:
        raise MeshError("mesh_volume", f"mesh volume {volume:.6g} m3, exact {exact:.6g} m3")
    return Solid(mesh, box, volume, exact, smallest, flat)
