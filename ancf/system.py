"""All that acts on the plate, summed: inertia, internal forces, loads, supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ancf.assembly import Assembly, Pattern, assembly, couple
from ancf.element import Integrand, PointElements, Terms, integrand, mass
from ancf.free_edge import strips
from ancf.loads import EdgeMoment, Load
from ancf.material import SaintVenantKirchhoff
from ancf.mesh import Mesh
from ancf.packing import element_order, pairs
from ancf.quadratic_form import QuadraticElements, from_first_node, quadratic_form
from ancf.subdomain import Band, element_rule, signature

ELEMENT_BYTES = 20_000  # of an element with 16 functions
MOST_FORM_BYTES = 1_500_000_000
EPSILON = np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Body:
    """A meshed plate without supports and loads.

    elements: force and tangent. connectivity (e, i) in the order of the elements. mass (v, v): scalar
    mass matrix in kg, which acts on each space component alike. mass_row (v,): integral of rho S.
    volume in m3 and the number of distinct element shapes. round_off (N/m) and round_off_r_z (N): see
    `System.force_floor`.
    """

    mesh: Mesh
    elements: QuadraticElements | PointElements
    connectivity: np.ndarray
    mass: sp.csr_matrix
    mass_row: np.ndarray
    volume: float
    shapes: int
    round_off: float
    round_off_r_z: float

    @property
    def total_mass(self) -> float:
        """Mass of the kept material in kg."""
        return float(self.mass_row[self.mesh.kinds == "r"].sum())


@dataclass(frozen=True, eq=False)
class System:
    """A body with held components, dead loads and moments; q, v, a are components (3 v,), sums over unknowns (u,).

    mass_values (nnz,): mass on the pattern of the tangent. lengths (u,): what a residual is divided by
    to become a force in N: 1 for positions, element sides for r_x and r_y, their product for r_xy, half
    the thickness for r_z and d_e.
    """

    body: Body
    assembly: Assembly
    loads: tuple[Load, ...]
    mass_values: np.ndarray
    lengths: np.ndarray
    moments: tuple[EdgeMoment, ...] = ()

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return len(self.assembly.free)

    def force_internal(self, q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (u,). more: pairs of a number and an array (3 v,), as in `QuadraticElements.force`."""
        gather = self.assembly.gather
        elements = self.body.elements.force(gather(q), [(c, gather(x)) for c, x in more])
        return self.assembly.vector(elements)[self.assembly.free]

    def force_external(self, t: float) -> np.ndarray:
        """Dead loads (u,) at time t."""
        return self.loads_total(t)[self.assembly.free]

    def loads_total(self, t: float) -> np.ndarray:
        """Dead loads (3 v,) at time t, those on held components included."""
        total = np.zeros(3 * len(self.body.mesh.vectors))
        for load in self.loads:
            total += load.factor(t) * load.force
        return total

    def moments_total(self, q: np.ndarray, t: float) -> np.ndarray:
        """Moments that turn with their edges (3 v,) at time t."""
        return sum((moment.force(q, t) for moment in self.moments), np.zeros_like(q))

    def tangent_static(self, q: np.ndarray, t: float) -> np.ndarray:
        """Values (nnz,) of the tangent of the internal force less the loads at time t."""
        data = self.tangent(q)
        for moment in self.moments:
            couple(self.assembly, moment.row, -moment.stiffness(q, t), data)
        return data

    def tangent(self, q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Values (nnz,) of the tangent of the internal force. more: as in `force_internal`."""
        gather = self.assembly.gather
        return self.assembly.matrix(self.body.elements.tangent(gather(q), [(c, gather(x)) for c, x in more]))

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """M a (u,) of accelerations (3 v,)."""
        return (self.body.mass @ a.reshape(-1, 3)).ravel()[self.assembly.free]

    def force_floor(self, q: np.ndarray) -> float:
        """Round-off (N) of the internal force: nodal vectors are stored to a part EPSILON of their size.

        In a thick plate the positions lead, in a thin one r_z: of size 1, it rounds the stress to EPSILON
        of the modulus, which on the area of an element and over half the thickness is its residual. Positions far
        from the origin do the same to it by way of the shear strain, EPSILON of their size over an element's.
        Measured on plates, strips, cylinders and spheres of 4 to 1,024 elements, 20 to 25,000 times as long as
        thick, Newton ends at 0.02 to 0.5 of this.
        """
        positions = np.abs(q.reshape(-1, 3)[self.body.mesh.kinds == "r"])
        return self.body.round_off * float(positions.max()) + self.body.round_off_r_z

    def is_inverted(self, q: np.ndarray) -> bool:
        """Whether r_x, r_y, r_z have lost their orientation at a node: the solution is then no deformation."""
        return bool(np.any(self.body.mesh.orientation(q.reshape(-1, 3)) <= 0))

    def energies(self, q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
        """Kinetic and strain energy in J."""
        v = v.reshape(-1, 3)
        kinetic = 0.5 * float(np.sum(v * (self.body.mass @ v)))
        return kinetic, self.body.elements.energy(self.assembly.gather(q))

    def norm(self, residual: np.ndarray) -> float:
        """Size of a residual (u,) in N."""
        return float(np.linalg.norm(residual / self.lengths))


def body(
    mesh: Mesh,
    bands: Sequence[Band],
    thickness: float,
    material: SaintVenantKirchhoff,
    density: float,
    points: tuple[int, int, int],
    integration: str = "subdomain",
    pointwise: bool = False,
    free: Sequence[str] = (),
) -> Body:
    """Integrate the elements of a mesh; those of equal shape and groove share their tensors.

    pointwise: keep the points instead of the tensors; so are meshes of very many distinct elements.
    free: free edges of the plate, for elements that have a layer there.
    Raises GeometryError where a groove leaves no material or a reference shape folds, ValueError where
    the points are too few for the element.
    """
    least = mesh.shape.least_points
    if any(count < few for count, few in zip(points, least, strict=True)):
        own, needed = ("x".join(map(str, counts)) for counts in (points, least))
        raise ValueError(f"{own} points leave the {mesh.shape.name} element modes without energy: {needed} at least")
    vectors = mesh.element_vectors
    free = free if mesh.shape.layer is not None and integration == "subdomain" else ()
    form_of, first = distinct(mesh, bands, free)
    divided = [*bands, *strips(mesh, thickness, free)]
    rules = [element_rule(mesh.cells[e], divided, thickness, points, integration) for e in first]
    sides = [_sides(mesh, e, free) for e in first]
    parts = [
        integrand(mesh.shape, rule, mesh.cells[e], vectors[e], own)
        for e, rule, own in zip(first, rules, sides, strict=True)
    ]
    pointwise = pointwise or len(parts) * form_bytes(len(mesh.shape.kinds)) > MOST_FORM_BYTES
    order = element_order(form_of)
    form_of, connectivity = form_of[order], mesh.connectivity[order]
    if pointwise:
        elements = PointElements(tuple(parts[g] for g in form_of), material)
    else:
        elements = _pre_integrated(parts, material, vectors[first], form_of, mesh)
    scalar = _mass_matrix(parts, form_of, connectivity, len(mesh.vectors), density)
    volume = float(np.array([part.volume.sum() for part in parts])[form_of].sum())
    row = scalar @ (mesh.kinds == "r").astype(float)
    rounded, sides = EPSILON * (material.lame + 2 * material.shear), mesh.edge_lengths
    size = (volume / thickness) ** (1 / 2)
    round_off = rounded * volume ** (2 / 3) / sides.min() + EPSILON * material.shear * size
    round_off_r_z = 2 * rounded * size * sides.max()
    return Body(mesh, elements, connectivity, scalar, row, volume, len(parts), round_off, round_off_r_z)


def _sides(mesh: Mesh, element: int, free: Sequence[str]) -> tuple[str, ...]:
    """The free edges that an element lies on."""
    return tuple(edge for edge in mesh.edges_of(element) if edge in free)


def distinct(mesh: Mesh, bands: Sequence[Band], free: Sequence[str] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Number of each element's shape (e,), and the first element of each shape (g,).

    Two shapes are equal when what they see of the grooves agrees, the free edges that they have a layer on,
    and the Gram matrices of their reference vectors: they then differ by a rigid motion, which an isotropic
    material does not see.
    """
    vectors = mesh.element_vectors
    Q = from_first_node(vectors, mesh.shape.positions)
    gram = Q @ Q.swapaxes(1, 2)
    rounded = np.round(gram / np.abs(gram).max(), 11) + 0.0
    keys = [
        (signature(cell, bands), _sides(mesh, e, free), row.tobytes())
        for e, (cell, row) in enumerate(zip(mesh.cells, rounded, strict=True))
    ]
    number: dict = {}
    form_of = np.array([number.setdefault(key, len(number)) for key in keys])
    return form_of, np.unique(form_of, return_index=True)[1]


def _pre_integrated(parts, material, vectors, form_of, mesh: Mesh) -> QuadraticElements:
    forms = [quadratic_form(part, material, Q, mesh.shape.positions) for part, Q in zip(parts, vectors, strict=True)]
    tensors = (
        np.stack([getattr(form, name) for form in forms]) for name in ("D0", "stress", "symmetric", "antisymmetric")
    )
    return QuadraticElements(*tensors, form_of, len(mesh.shape.kinds), mesh.shape.positions)


def _mass_matrix(parts: list[Integrand], form_of, connectivity, vectors: int, density: float) -> sp.csr_matrix:
    """Scalar mass matrix (v, v) in kg."""
    values = np.stack([mass(part, density) for part in parts])[form_of]
    rows, columns = np.broadcast_arrays(connectivity[:, :, None], connectivity[:, None, :])
    return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(vectors, vectors))


def expected_memory(mesh: Mesh, unknowns: int, shapes: int) -> float:
    """Memory (MB) of a whole process that solves on this mesh with so many distinct elements."""
    elements, functions = mesh.connectivity.shape
    band = 3 * int(np.ptp(mesh.connectivity, axis=1).max() + 1)
    own = ELEMENT_BYTES * (functions / 16) ** 2
    return 92 + 1e-6 * (form_bytes(functions) * shapes + own * elements + 2 * 8 * band * unknowns)


def form_bytes(functions: int) -> int:
    """Memory of the tensors of one distinct element."""
    pair = pairs(functions)
    moving, all_pairs = len(pair.moving), len(pair.first)
    return 8 * (2 * moving * all_pairs + pair.moving_crossed * pair.crossed)


def system(
    plate: Body, held: np.ndarray, loads: Sequence[Load], thickness: float, moments: Sequence[EdgeMoment] = ()
) -> System:
    """The body with held components (3 v,), dead loads and moments."""
    coupled = [np.flatnonzero(moment.row) for moment in moments]
    sums = assembly(plate.connectivity, len(plate.mesh.vectors), held, coupled)
    mesh = plate.mesh
    a, b = (np.ptp(lines) / (len(lines) - 1) for lines in (mesh.x_lines, mesh.y_lines))
    sides = {"r": 1.0, "r_x": a, "r_y": b, "r_xy": a * b, "r_z": thickness / 2, "d_e": thickness / 2}
    lengths = np.repeat([sides[kind] for kind in mesh.kinds], 3)[sums.free]
    return System(plate, sums, tuple(loads), _on_pattern(plate.mass, sums), lengths, tuple(moments))


def _on_pattern(scalar: sp.csr_matrix, sums: Assembly) -> np.ndarray:
    """Values (nnz,) of the mass matrix, scalar x 1, on the pattern of the tangent."""
    full = sp.kron(scalar, sp.eye_array(3), format="csc")[sums.free][:, sums.free]
    lower = sp.tril(full, format="csc")
    lower.sort_indices()
    n = sums.pattern.n
    values = np.zeros(len(sums.pattern.indices))
    values[np.searchsorted(_keys(sums.pattern, n), _keys(lower, n))] = lower.data
    return values


def _keys(matrix: Pattern | sp.csc_matrix, n: int) -> np.ndarray:
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(matrix.indptr))
    return columns * n + matrix.indices
