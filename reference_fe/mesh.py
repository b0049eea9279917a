"""Second-order tetrahedra on the grooved solid: gmsh meshes the box, scikit-fem holds the mesh.

On a curved mid-surface every node of the box mesh is carried to X = S(x, y) + z n(x, y); S and its
derivatives are evaluated by OCC (through gmsh). The tetrahedra are isoparametric there. Where the surface
closes on itself, the faces of the box that meet are meshed alike, and their nodes become one in space.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType

import numpy as np
from skfem import Basis, ElementTetP2, MeshTet2

from reference_fe.geometry import Curve, MeshError, Plate, build, session
from reference_fe.seam import glue, match_seam
from reference_fe.surface import Revolved, Surface, carry, volume_element

VOLUME_ERROR = 0.01
NUDGE = 1e-6  # of the box's thinnest side: nodes at a curved groove are moved by whole multiples of it
EDGES_PER_TURN = 6  # least number of edges on a full turn of a curved section or outline, whatever the size
TO_SKFEM = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # gmsh's tetra10 has its last two edges the other way round


@dataclass(frozen=True)
class Solid:
    """A checked mesh. mesh: scikit-fem tetrahedra in space (m). box: the same tetrahedra in the box (m).

    exact_volume is the solid's own (m3); volume the mesh's; flat: mesh and box are the same. Node numbers
    are those of scikit-fem's scalar P2 element: vertices first, then edges. At a closed seam the box has two nodes
    where the mesh has one, so that only the elements are numbered alike.
    """

    mesh: MeshTet2
    box: MeshTet2
    volume: float
    exact_volume: float
    smallest_jacobian: float
    flat: bool

    @cached_property
    def places(self) -> np.ndarray:
        """Box coordinates (3, n) of the nodes of the mesh; those of a seam are at its lesser x."""
        if self.box.doflocs.shape == self.mesh.doflocs.shape:
            return self.box.doflocs
        places = np.full(self.mesh.doflocs.shape, np.inf)
        nodes, own = (mesh.dofs.element_dofs.ravel() for mesh in (self.mesh, self.box))
        for axis in range(3):
            np.minimum.at(places[axis], nodes, self.box.doflocs[axis, own])
        return places

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

    features: (ratio, reach, (x0, x1), (y0, y1), (z0, z1)) each. edges: (ratio, reach, points (k, 3)) each, points
    along a curved or slanted edge no farther from each other than a quarter of the reach.
    """

    size: float
    features: tuple[tuple[float, float, tuple[float, float], tuple[float, float], tuple[float, float]], ...] = ()
    edges: tuple[tuple[float, float, np.ndarray], ...] = ()


def make(plate: Plate, spacing: Spacing, surface: Surface | Revolved | None = None) -> Solid:
    """Build, mesh, carry to the mid-surface if there is one, and check.

    Raises MeshError with the status "gmsh_missing", "gmsh_busy", "geometry_failed", "mesh_failed",
    "surface_degenerate", "seam_open" (faces that meet do not match), "mesh_inverted" (a Jacobian is not
    positive) or "mesh_volume" (the mesh misses the exact volume by more than VOLUME_ERROR).
    """
    with session() as gmsh:
        exact = build(gmsh, plate)
        if any(isinstance(band.section, Curve) for band in plate.grooves + plate.protrusions):
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", EDGES_PER_TURN)
        if plate.closed:
            match_seam(gmsh, plate.length)
        points, tetrahedra = _tetrahedralise(gmsh, spacing)
    box = MeshTet2(np.ascontiguousarray(points.T), np.ascontiguousarray(tetrahedra[:, TO_SKFEM].T))
    flat = _check(box, exact)
    if surface is None:
        return flat
    fine = Basis(box, ElementTetP2(), intorder=6)
    where = fine.global_coordinates()
    exact = float(np.sum(volume_element(surface, where.reshape(3, -1)) * fine.dx.ravel()))
    mesh = replace(box, doflocs=np.ascontiguousarray(carry(surface, box.doflocs)))
    curved = _check(glue(mesh, box.doflocs, plate.length) if plate.closed else mesh, exact)
    return replace(curved, box=box, flat=False)


def store(solid: Solid, path: Path) -> None:
    """Write the mesh in space as VTK's unstructured grid (.vtu) with second-order tetrahedra."""
    import meshio

    path.parent.mkdir(parents=True, exist_ok=True)
    nodes = solid.mesh.dofs.element_dofs.T.astype(np.int64)
    meshio.Mesh(solid.mesh.doflocs.T, [("tetra10", nodes)]).write(path)


def _tetrahedralise(gmsh: ModuleType, spacing: Spacing) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and second-order tetrahedra (m, 10) of the current model, in gmsh's node order."""
    option = gmsh.option.setNumber
    for name in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
        option(f"Mesh.{name}", 0)
    option("Mesh.MeshSizeMax", spacing.size)
    _grade(gmsh, spacing)
    try:
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        tags, coordinates = _straightened(gmsh)
    except Exception as error:
        raise MeshError("mesh_failed", f"gmsh: {error}") from error
    index = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    index[tags] = np.arange(tags.size)
    _, nodes = gmsh.model.mesh.getElementsByType(11)
    if nodes.size == 0:
        raise MeshError("mesh_failed", "gmsh made no tetrahedra")
    used, tetrahedra = np.unique(index[nodes], return_inverse=True)
    return coordinates[used], tetrahedra.reshape(-1, 10)


def _grade(gmsh: ModuleType, spacing: Spacing) -> None:
    """Set the edge length wished for everywhere."""
    field = gmsh.model.mesh.field
    wishes = []
    for ratio, reach, *sides in spacing.features:
        wishes.append(field.add("Box"))
        numbers = {"VIn": ratio * spacing.size, "VOut": spacing.size, "Thickness": reach}
        for axis, side in zip("XYZ", sides, strict=True):
            numbers |= {f"{axis}Min": side[0], f"{axis}Max": side[1]}
        for name, value in numbers.items():
            field.setNumber(wishes[-1], name, value)
    for ratio, reach, points in spacing.edges:
        tags = [gmsh.model.occ.addPoint(*point) for point in points]
        gmsh.model.occ.synchronize()
        distance = field.add("Distance")
        field.setNumbers(distance, "PointsList", tags)
        wishes.append(field.add("Threshold"))
        numbers = {"InField": distance, "SizeMin": ratio * spacing.size, "SizeMax": spacing.size}
        numbers |= {"DistMin": reach / 8, "DistMax": reach * 9 / 8}
        for name, value in numbers.items():
            field.setNumber(wishes[-1], name, value)
    if wishes:
        least = field.add("Min")
        field.setNumbers(least, "FieldsList", wishes)
        field.setAsBackgroundMesh(least)


def _straightened(gmsh: ModuleType) -> tuple[np.ndarray, np.ndarray]:
    """Tags (n,) and coordinates (n, 3) of the nodes, moved until no tetrahedron at a curved groove is inverted.

    gmsh's optimiser takes nodes in the order of their addresses and so rounds otherwise each time. Moves are whole
    multiples of NUDGE, so that equal questions have equal meshes as long as its iterations do not blow that up.
    """
    tags, before, _ = gmsh.model.mesh.getNodes()
    before = before.reshape(-1, 3)
    tetrahedra, _ = gmsh.model.mesh.getElementsByType(11)
    if gmsh.model.mesh.getElementQualities(tetrahedra, "minDetJac").min() > 0:
        return tags, before
    gmsh.model.mesh.optimize("HighOrder")
    again, after, _ = gmsh.model.mesh.getNodes()
    step, moved = NUDGE * np.ptp(before, axis=0).min(), np.empty_like(before)
    moved[np.argsort(tags)] = after.reshape(-1, 3)[np.argsort(again)] - before[np.argsort(tags)]
    return tags, before + step * np.rint(moved / step)


def _check(mesh: MeshTet2, exact: float) -> Solid:
    """The mesh as a Solid in its own box. Raises MeshError "mesh_inverted" or "mesh_volume"."""
    basis = Basis(mesh, ElementTetP2(), intorder=6)
    smallest = float(basis.mapping.detDF(basis.X).min())
    if not smallest > 0:
        raise MeshError("mesh_inverted", f"smallest Jacobian {smallest:.3g} m3: a tetrahedron is inverted")
    volume = float(basis.dx.sum())
    if not abs(volume - exact) < VOLUME_ERROR * exact:
        raise MeshError("mesh_volume", f"mesh volume {volume:.6g} m3, exact {exact:.6g} m3")
    return Solid(mesh, mesh, volume, exact, smallest, flat=True)
