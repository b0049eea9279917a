"""All that acts on the plate, summed: inertia, internal forces, loads, supports."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.sparse as sp

from ancf.assembly import Assembly, MixedAssembly, assembly, couple, mixed_assembly, on_pattern
from ancf.element import Integrand, PointElements, Terms, integrand, mass, signed
from ancf.free_edge import strips
from ancf.layer import wall_strips
from ancf.loads import EdgeMoment, Load
from ancf.material import MooneyRivlin, SaintVenantKirchhoff
from ancf.mesh import Mesh
from ancf.packing import element_order, pairs
from ancf.parity import Mirrors
from ancf.pressure import FollowerPressure
from ancf.quadratic_form import QuadraticElements, quadratic_form
from ancf.sharing import Sharing, possible, sharing, sides
from ancf.split_form import SplitFormElements, is_split, split_form
from ancf.subdomain import Feature, element_rule
from ancf.wall import wall_sides

if TYPE_CHECKING:
    from ancf.contact import Contact
    from ancf.hyperelastic import HyperelasticElements, SplitElements
    from ancf.rim import Rim

    Elements = QuadraticElements | SplitFormElements | PointElements | HyperelasticElements | SplitElements

ELEMENT_BYTES = 20_000  # of an element with 16 functions
REPAID = 8  # elements that share a form: from here on their tensors take less time than one tangent from points
DENSE = 150  # nodal vectors: then all of the mass matrix is multiplied in the time a sparse product takes to begin
MOST_FORM_BYTES = 1_500_000_000
POINTS = 1 / 3  # of the memory of its tensors: that of a distinct element's 7 x 7 x 3 points
EPSILON = np.finfo(float).eps

Material = SaintVenantKirchhoff | MooneyRivlin
RELAXED, REDUCED, FULL = "relaxed", "reduced", "full"
MixedTerms = Sequence[tuple[float, Sequence[np.ndarray]]]


@dataclass(frozen=True, eq=False)
class MixedElements:
    """Groups of elements with unequally many functions: Q and what comes of it are sequences, one by group."""

    groups: tuple[Elements, ...]

    def energy(self, Q: Sequence[np.ndarray]) -> float:
        """Strain energy (J)."""
        return sum(group.energy(own) for group, own in zip(self.groups, Q, strict=True))

    def force(self, Q: Sequence[np.ndarray], more: MixedTerms = ()) -> list[np.ndarray]:
        """Internal force (e, i, 3) of each group. more: as in `QuadraticElements.force`, X by group."""
        return [group.force(Q[g], _own(more, g)) for g, group in enumerate(self.groups)]

    def tangent(self, Q: Sequence[np.ndarray], more: MixedTerms = ()) -> Iterator[Iterator[np.ndarray]]:
        """Packed tangents of each group, span by span. more: as in `force`."""
        return (group.tangent(Q[g], _own(more, g)) for g, group in enumerate(self.groups))


def _own(more: MixedTerms, group: int) -> Terms:
    """The terms of one group."""
    return [(c, X[group]) for c, X in more]


@dataclass(frozen=True, eq=False)
class Body:
    """A meshed plate without supports and loads.

    elements: force and tangent. connectivity (e, i) in the order of the elements, on a mesh with special
    elements one array for each group of equally many functions. mass (v, v): scalar
    mass matrix in kg, which acts on each space component alike. mass_row (v,): integral of rho S.
    volume in m3 and the number of distinct element shapes. round_off (N/m) and round_off_r_z (N): see
    `System.force_floor`.
    """

    mesh: Mesh
    elements: Elements | MixedElements
    connectivity: np.ndarray | tuple[np.ndarray, ...]
    mass: sp.csr_matrix
    mass_row: np.ndarray
    volume: float
    shapes: int
    round_off: float
    round_off_r_z: float

    @cached_property
    def total_mass(self) -> float:
        """Mass of the kept material in kg."""
        return float(self.mass_row[self.mesh.kinds == "r"].sum())


@dataclass(frozen=True, eq=False)
class System:
    """A body with held components, loads, dead and following, what it may touch, and the rim that holds its edges.

    q, v, a are components (3 v,), sums over unknowns (u,). A rim's tied components are unknowns each; the sum of their
    forces is at the first of them.

    mass_values (nnz,): mass on the pattern of the tangent. lengths (u,): what a residual is divided by
    to become a force in N: 1 for positions, element sides for r_x and r_y, their product for r_xy, half
    the thickness for r_z, d_e and d_l.
    """

    body: Body
    assembly: Assembly | MixedAssembly
    loads: tuple[Load, ...]
    mass_values: np.ndarray
    lengths: np.ndarray
    moments: tuple[EdgeMoment, ...] = ()
    pressures: tuple[FollowerPressure, ...] = ()
    contact: Contact | None = None
    rim: Rim | None = None

    @property
    def unknowns(self) -> int:
        """Number of unknowns; what a rim ties counts once."""
        return len(self.assembly.free) - (0 if self.rim is None else self.rim.spared)

    def on_unknowns(self, total: np.ndarray) -> np.ndarray:
        """Forces (u,) of those on all components (3 v,)."""
        return (total if self.rim is None else self.rim.sums(total))[self.assembly.free]

    def force_internal(self, q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (u,). more: pairs of a number and an array (3 v,), as in `QuadraticElements.force`."""
        return self.on_unknowns(self.internal_total(q, more))

    def internal_total(self, q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Internal force (3 v,), that on held components included."""
        gather = self.assembly.gather
        return self.assembly.vector(self.body.elements.force(gather(q), [(c, gather(x)) for c, x in more]))

    def force_external(self, t: float) -> np.ndarray:
        """Dead loads (u,) at time t."""
        return self.on_unknowns(self.loads_total(t))

    def loads_total(self, t: float) -> np.ndarray:
        """Dead loads (3 v,) at time t, those on held components included."""
        total = np.zeros(3 * len(self.body.mesh.vectors))
        for load in self.loads:
            total += load.factor(t) * load.force
        return total

    @property
    def following(self) -> tuple[EdgeMoment | FollowerPressure, ...]:
        """The loads that follow the motion."""
        return *self.moments, *self.pressures

    def following_total(self, q: np.ndarray, t: float) -> np.ndarray:
        """Loads that follow the motion (3 v,) at time t: moments that turn with their edges, follower pressures."""
        total = np.zeros_like(q)
        for load in self.following:
            total += load.force(q, t)
        return total

    def force_following(self, q: np.ndarray, t: float) -> np.ndarray:
        """The same on the unknowns (u,)."""
        return self.on_unknowns(self.following_total(q, t))

    def tangent_loaded(self, q: np.ndarray, t: float, more: Terms = ()) -> np.ndarray:
        """Values (nnz,) of the tangent of the internal force less the loads at time t. more: as in `tangent`."""
        data = self.tangent(q, more)
        for moment in self.moments:
            couple(self.assembly, moment.row, -moment.stiffness(q, t), data)
        for pressure in self.pressures:
            data += self._faces.matrix(pressure.stiffness(q, t))
        return data

    @cached_property
    def _faces(self) -> Assembly:
        """Sums over the faces of all elements, in the order of the mesh."""
        assembly = self.assembly
        return on_pattern(self.pressures[0].connectivity, assembly.free, assembly.unknown_of, assembly.pattern)

    def tangent(self, q: np.ndarray, more: Terms = ()) -> np.ndarray:
        """Values (nnz,) of the tangent of the internal force. more: as in `force_internal`."""
        gather = self.assembly.gather
        return self.assembly.matrix(self.body.elements.tangent(gather(q), [(c, gather(x)) for c, x in more]))

    def inertia(self, a: np.ndarray) -> np.ndarray:
        """M a (u,) of accelerations (3 v,), a rim's mass included."""
        return self.on_unknowns(self.inertia_total(a))

    def inertia_total(self, a: np.ndarray) -> np.ndarray:
        """M a (3 v,), that on held components included."""
        total = (self._mass @ a.reshape(-1, 3)).ravel()
        if self.rim is not None and self.rim.mass:
            total += self.rim.inertia(a)
        return total

    @cached_property
    def _mass(self) -> sp.csr_matrix | np.ndarray:
        """Scalar mass matrix in the form that multiplies fastest."""
        mass = self.body.mass
        return mass.toarray() if mass.shape[0] <= DENSE else mass

    def force_floor(self, q: np.ndarray) -> float:
        """Round-off (N) of the internal force: nodal vectors are stored to a part EPSILON of their size.

        In a thick plate the positions lead, in a thin one r_z: of size 1, it rounds the stress to EPSILON
        of the modulus, which on the area of an element and over half the thickness is its residual. Positions far
        from the origin do the same to it by way of the shear strain, EPSILON of their size over an element's.
        Measured on plates, strips, cylinders and spheres of 4 to 1,024 elements, 20 to 25,000 times as long as
        thick, Newton ends at 0.02 to 0.5 of this.
        """
        largest = float(np.abs(q.take(self._positions)).max())
        return self.body.round_off * largest + self.body.round_off_r_z

    @cached_property
    def _positions(self) -> np.ndarray:
        """Components of positions among all (3 r,)."""
        return np.flatnonzero(np.repeat(self.body.mesh.kinds == "r", 3))

    def is_inverted(self, q: np.ndarray) -> bool:
        """Whether r_x, r_y, r_z have lost their orientation at a node: the solution is then no deformation."""
        return bool(np.any(self.body.mesh.orientation(q.reshape(-1, 3)) <= 0))

    def energies(self, q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
        """Kinetic and strain energy in J."""
        v = v.reshape(-1, 3)
        kinetic = 0.5 * float(np.vdot(v, self._mass @ v))
        if self.rim is not None:
            kinetic += self.rim.mass / 2 * float(np.sum((self.rim.row @ v) ** 2))
        return kinetic, self.body.elements.energy(self.assembly.gather(q))

    def norm(self, residual: np.ndarray) -> float:
        """Size of a residual (u,) in N."""
        forces = residual / self.lengths
        return math.sqrt(forces @ forces)


def body(
    mesh: Mesh,
    bands: Sequence[Feature],
    thickness: float,
    material: Material,
    density: float,
    points: tuple[int, int, int],
    integration: str = "subdomain",
    pointwise: bool = False,
    free: Sequence[str] = (),
    volumetric: str = RELAXED,
    once: bool = False,
) -> Body:
    """Integrate the elements of a mesh; those of equal shape and groove share their tensors.

    pointwise: keep the points instead of the tensors; so are meshes of very many distinct elements. once: whether a
    single tangent is asked for, which tensors repay only where many elements share them.
    free: free edges of the plate, for elements that have a layer there; only St. Venant-Kirchhoff ones do.
    volumetric: RELAXED, REDUCED or FULL, for Mooney-Rivlin material: see `compare.scene.AncfLevel`.
    Raises GeometryError where a groove leaves no material or a reference shape folds, ValueError where
    the points are too few for the element.
    """
    linear = isinstance(material, SaintVenantKirchhoff)
    free = free if linear and mesh.shape.layer is not None and integration != "global" else ()
    _require_points(mesh, points, free)
    divided = dividing(mesh, bands, thickness, free)
    shared = sharing(mesh, divided, free, possible(mesh, points) if linear else ())

    def integrands(counts: tuple[int, int, int]) -> list[Integrand]:
        return [_part(mesh, e, divided, thickness, counts, integration, free, linear) for e in shared.first]

    parts = integrands(points)
    functions = np.array([part.S.shape[1] for part in parts])
    pointwise = pointwise or sum(map(form_bytes, functions.tolist())) > MOST_FORM_BYTES
    pointwise = pointwise or (once and len(mesh.cells) < REPAID * len(parts))
    groups = [_group(mesh, parts, shared, functions == count) for count in np.unique(functions)]
    if linear:
        elements = tuple(_elements(group, mesh, material, pointwise) for group in groups)
    else:
        fewer = integrands(tuple(count - 1 for count in points)) if volumetric == REDUCED else None
        elements = tuple(_hyperelastic(group, mesh, material, volumetric, fewer) for group in groups)
    scalar = sum(_mass_matrix(group, len(mesh.vectors), density) for group in groups)
    volume = float(np.array([part.volume.sum() for part in parts])[shared.form_of].sum())
    row = scalar @ (mesh.kinds == "r").astype(float)
    rounded, sides = EPSILON * (material.lame + 2 * material.shear), mesh.edge_lengths
    size = (volume / thickness) ** (1 / 2)
    round_off = rounded * volume ** (2 / 3) / sides.min() + EPSILON * material.shear * size
    round_off_r_z = 2 * rounded * size * sides.max()
    connectivity = tuple(group.connectivity for group in groups)
    parts_of_body = (MixedElements(elements), connectivity) if mesh.special else (elements[0], connectivity[0])
    return Body(mesh, *parts_of_body, scalar, row, volume, len(parts), round_off, round_off_r_z)


def dividing(mesh: Mesh, bands: Sequence[Feature], thickness: float, free: Sequence[str]) -> list[Feature]:
    """All that divides elements: the bands, where layers on the free edges and beside walls end, and walls."""
    return [*bands, *strips(mesh, thickness, free), *wall_strips(mesh, thickness), *wall_sides(mesh, bands)]


class _Group(NamedTuple):
    """Elements of equally many functions in their order: Integrand of each form, and by element form (e,),
    connectivity (e, i) in the order of its form, and signs (e, i): see `ancf.image`.

    own (g,): which of all forms these are; mirrors (g,): those of each, see `ancf.parity`.
    """

    parts: list[Integrand]
    form_of: np.ndarray
    connectivity: np.ndarray
    signs: np.ndarray
    own: np.ndarray
    mirrors: list[Mirrors]


def _part(
    mesh: Mesh, e: int, bands, thickness: float, points, integration: str, free: Sequence[str], enhanced: bool
) -> Integrand:
    """Integrand of an element."""
    (shape, vectors), cell = mesh.element(e), mesh.cells[e]
    rule = element_rule(cell, bands, thickness, points, integration, mesh.levels(e), through=not enhanced)
    return integrand(shape, rule, cell, mesh.vectors[vectors], sides(mesh, e, free), enhanced)


def _group(mesh: Mesh, parts: Sequence[Integrand], shared: Sharing, own: np.ndarray) -> _Group:
    """The elements whose form is one of `own` (g,)."""
    members = np.flatnonzero(own[shared.form_of])
    members = members[element_order(shared.form_of[members], shared.image_of[members])]
    connectivity = np.stack([shared.vectors(mesh, e) for e in members])
    signs = np.stack([shared.signs(e, connectivity.shape[1]) for e in members])
    form_of, kept = (np.cumsum(own) - 1)[shared.form_of[members]], np.flatnonzero(own)
    mirrors = [shared.mirrors[g] for g in kept]
    return _Group([parts[g] for g in kept], form_of, connectivity, signs, kept, mirrors)


def _elements(group: _Group, mesh: Mesh, material: SaintVenantKirchhoff, pointwise: bool) -> Elements:
    if pointwise:
        kinds = [(int(g), signs.tobytes()) for g, signs in zip(group.form_of, group.signs, strict=True)]
        parts = {kind: signed(group.parts[kind[0]], signs) for kind, signs in zip(kinds, group.signs, strict=True)}
        return PointElements(tuple(parts[kind] for kind in kinds), material)
    first = np.unique(group.form_of, return_index=True)[1]
    reference = group.signs[first, :, None] * mesh.vectors[group.connectivity[first]]
    if is_split(mesh.shape, [group.mirrors[g] for g in group.form_of]):
        several = zip(group.parts, reference, group.mirrors, strict=True)
        forms = tuple(split_form(part, material, Q, mesh.shape, mirrors) for part, Q, mirrors in several)
        return SplitFormElements(forms, group.form_of, group.signs, mesh.shape)
    return _pre_integrated(group, material, reference, mesh)


def _hyperelastic(
    group: _Group, mesh: Mesh, material: MooneyRivlin, volumetric: str, fewer: Sequence[Integrand] | None
) -> HyperelasticElements | SplitElements:
    """Elements of Mooney-Rivlin material. fewer: integrands of all forms for the reduced volumetric energy."""
    from ancf.hyperelastic import SHEAR, HyperelasticElements, SplitElements, form  # and numba, for rubber alone

    shear = SHEAR if mesh.shape.shear is not None and volumetric == RELAXED else 1.0

    def elements(law: MooneyRivlin, parts: Sequence[Integrand]) -> HyperelasticElements:
        forms = tuple(map(form, parts))
        return HyperelasticElements(law, forms, group.form_of, volumetric == RELAXED, shear)

    if fewer is None:
        return elements(material, group.parts)
    isochoric, only_volume = replace(material, bulk=0.0), replace(material, mu10=0.0, mu01=0.0)
    return SplitElements(elements(isochoric, group.parts), elements(only_volume, [fewer[g] for g in group.own]))


def _require_points(mesh: Mesh, points: tuple[int, int, int], free: Sequence[str]) -> None:
    """Raises ValueError where so few points leave modes without energy, or layers that they cannot tell apart.

    An element between two free edges has a layer on each: one point more tells both from its polynomials.
    """
    between = [{axis + "0", axis + "1"} <= set(mesh.edges_of(0)) & set(free) for axis in "xy"]
    least = tuple(few + more for few, more in zip(mesh.shape.least_points, (*between, 0), strict=True))
    if any(count < few for count, few in zip(points, least, strict=True)):
        own, needed = ("x".join(map(str, counts)) for counts in (points, least))
        raise ValueError(f"{own} points leave the {mesh.shape.name} element modes without energy: {needed} at least")


def _pre_integrated(group: _Group, material: SaintVenantKirchhoff, vectors: np.ndarray, mesh: Mesh):
    """The quadratic forms of a group; vectors (g, i, 3): reference nodal vectors of each."""
    positions = mesh.shape.positions
    forms = [quadratic_form(part, material, Q, positions) for part, Q in zip(group.parts, vectors, strict=True)]
    tensors = (
        np.stack([getattr(form, name) for form in forms]) for name in ("D0", "stress", "symmetric", "antisymmetric")
    )
    return QuadraticElements(*tensors, group.form_of, group.signs, positions)


def _mass_matrix(group: _Group, vectors: int, density: float) -> sp.csr_matrix:
    """Scalar mass matrix (v, v) in kg."""
    parts, form_of, connectivity, signs = group[:4]
    values = np.stack([mass(part, density) for part in parts])[form_of] * signs[:, :, None] * signs[:, None, :]
    rows, columns = np.broadcast_arrays(connectivity[:, :, None], connectivity[:, None, :])
    return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(vectors, vectors))


def expected_memory(mesh: Mesh, unknowns: int, first: np.ndarray) -> float:
    """Memory (MB) of a whole process that solves on this mesh; first: an element of each distinct shape."""
    functions = np.array([len(mesh.element(e).vectors) for e in range(len(mesh.connectivity))])
    band = 3 * int(np.ptp(mesh.connectivity, axis=1).max() + 1)
    own = ELEMENT_BYTES * float(((functions / 16) ** 2).sum())
    forms = sum(map(form_bytes, functions[first].tolist()))
    forms *= POINTS if forms > MOST_FORM_BYTES else 1
    return 92 + 1e-6 * (forms + own + 2 * 8 * band * unknowns)


def form_bytes(functions: int) -> int:
    """Memory of the tensors of one distinct element."""
    pair = pairs(functions)
    moving, all_pairs = len(pair.moving), len(pair.first)
    return 8 * (2 * moving * all_pairs + pair.moving_crossed * pair.crossed)


def system(
    plate: Body,
    held: np.ndarray,
    loads: Sequence[Load],
    thickness: float,
    moments: Sequence[EdgeMoment] = (),
    pressures: Sequence[FollowerPressure] = (),
    rim: Rim | None = None,
) -> System:
    """The body with held components (3 v,), dead loads, moments, follower pressures, and a rim that holds edges."""
    coupled = [np.flatnonzero(moment.row) for moment in moments]
    mesh, held = plate.mesh, held if rim is None else held | rim.held
    sums = (mixed_assembly if mesh.special else assembly)(plate.connectivity, len(mesh.vectors), held, coupled)
    a, b = (np.ptp(lines) / (len(lines) - 1) for lines in (mesh.x_lines, mesh.y_lines))
    sides = {
        "r": 1.0,
        "r_x": a,
        "r_y": b,
        "r_xy": a * b,
        "r_z": thickness / 2,
        "d_e": thickness / 2,
        "d_l": thickness / 2,
        "r_w": 1.0,
        "d_w": thickness / 2,
        "l_w": thickness / 2,
    }
    lengths = np.repeat([sides[kind] for kind in mesh.kinds], 3)[sums.free]
    values = _on_pattern(plate.mass, sums)
    if rim is not None:
        values[sums.pattern.indptr[sums.unknown_of[rim.masters]]] += rim.mass  # the diagonal begins a column
    return System(plate, sums, tuple(loads), values, lengths, tuple(moments), tuple(pressures), rim=rim)


def _on_pattern(scalar: sp.csr_matrix, sums: Assembly | MixedAssembly) -> np.ndarray:
    """Values (nnz,) of the mass matrix, scalar x 1, on the pattern of the tangent."""
    scalar = scalar.tocoo()
    row, column = (sums.unknown_of.reshape(-1, 3)[place] for place in (scalar.row, scalar.col))
    lower = (row >= column) & (column >= 0)
    keys = column[lower].astype(np.int64) * len(sums.free) + row[lower]
    values = np.zeros(len(sums.pattern.indices))
    values[np.searchsorted(sums.pattern.keys, keys)] = np.repeat(scalar.data[:, None], 3, axis=1)[lower]
    return values
