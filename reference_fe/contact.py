"""Contact of one face of the solid with rigid bodies that stand still, by penalty at points of its facets.

Gap g (m) of a point of the face from a body, penetration d = -g, pressure p = max(0, k d + c d') where d > 0, Coulomb
friction that sticks by a spring and a damper and slips beyond mu p (compare/scene_contact.py states the law).

A time step takes the pressure that it has on average while each point goes straight from one end to the other:
with d from a to b at the rate d', ∫ p dd / (b - a), a closed form of piecewise polynomials. So the force is continuous
where a point comes or goes, also with a damper, and the spring gives back what it took: together with a mean normal
n . (x1 - x0) = -(d1 - d0), which for plane, sphere and drum is (r0 + r1) / (|r0| + |r1|) of the arms r from the body's
centre, the work of a step is exactly the change of the stored energy and what the damper took, whatever the step
(discrete gradient: Gonzalez, J. Nonlinear Sci. 6 (1996) 449; of contact: Hauret, Le Tallec, CMAME 195 (2006) 4890).
Friction is mapped back at the end of the step with the mean pressure: it never gains energy, and while it sticks it
is damped by h/2 times its stiffness besides its own damper. The slip falls back, it never rises: a damper that
slides before its spring is at the limit leaves the slip as it is.

With law "pressure" the points are those of a rule on the true facets and each stands for its area; with law
"points" they are the nodes of the face, each with the whole stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skfem import ElementTetP2, FacetBasis

from reference_fe import contact_kernel
from reference_fe.contact_kernel import DRUM, PLANE, SPHERE
from reference_fe.elasticity import Pattern
from reference_fe.facets import facet_basis, in_space, places_on
from reference_fe.geometry import MeshError
from reference_fe.mesh import Solid

DEGREE = 6  # 12 points on a facet: a front of contact that crosses it makes the pressure kinked
WALL = 1e-6  # of a facet's normal along z, where it belongs to no face
REACH = 1e-9  # of the solid's extent: a gap that statics takes for closed, lest a body that just touches floats

Body = tuple[int, np.ndarray, np.ndarray, float]


def plane(point: np.ndarray, normal: np.ndarray) -> Body:
    """Half space below the plane through a point (3,) whose normal (3,) points out of it."""
    return PLANE, np.array(point, dtype=float), _unit(normal), 0.0


def sphere(centre: np.ndarray, radius: float) -> Body:
    """Ball."""
    return SPHERE, np.array(centre, dtype=float), np.array([0.0, 0.0, 1.0]), float(radius)


def drum(point: np.ndarray, axis: np.ndarray, radius: float) -> Body:
    """Endless cylinder about the axis (3,) through a point (3,)."""
    return DRUM, np.array(point, dtype=float), _unit(axis), float(radius)


def _unit(direction: np.ndarray) -> np.ndarray:
    return np.array(direction, dtype=float) / np.linalg.norm(direction)


@dataclass(frozen=True)
class Law:
    """stiffness k and stick's (N/m3), damping c and stick's (N s/m3), friction mu; of points N/m and N s/m."""

    stiffness: float
    damping: float = 0.0
    friction: float = 0.0
    stick_stiffness: float | None = None
    stick_damping: float | None = None

    @property
    def numbers(self) -> tuple[float, float, float, float, float]:
        """(k, c, mu, k_s, c_s); stick as stiff and damped as the normal where nothing else is stated."""
        k_s = self.stiffness if self.stick_stiffness is None else self.stick_stiffness
        c_s = self.damping if self.stick_damping is None else self.stick_damping
        return tuple(float(number) for number in (self.stiffness, self.damping, self.friction, k_s, c_s))


@dataclass(frozen=True)
class Face:
    """Contact points of a face: f facets of a nodes each with q points.

    nodes (f, a); shape (f, q, a); weight (f, q) in m2, or 1 of law "points"; place (f, q, 3) at rest and box (f, q, 3)
    in the box (m); slot (f, a, a): places in the tangent as in elasticity.Pattern.
    """

    nodes: np.ndarray
    shape: np.ndarray
    weight: np.ndarray
    place: np.ndarray
    box: np.ndarray
    slot: np.ndarray


def face(solid: Solid, where: Pattern, side: int, law: str = "pressure", degree: int = DEGREE) -> Face:
    """The true face of side -1 (bottom) or 1 (top): floors of grooves are part of it, walls along z are not.

    A facet belongs to it if its normal in the box has a part along that side's z.
    """
    facets = solid.box.boundary_facets()
    flat = FacetBasis(solid.box, ElementTetP2(), facets=facets, intorder=degree)
    upward = np.sum(flat.normals[2] * flat.dx, axis=1) / flat.dx.sum(axis=1)
    facets = in_space(solid, facets[side * upward > WALL])
    if facets.size == 0:
        raise MeshError("face_missing", f"no facet of the mesh lies on the {'bottom' if side < 0 else 'top'} face")
    basis = facet_basis(solid.mesh, facets, degree)
    box = places_on(solid, basis)
    values = np.array([np.asarray(shape[0]) for shape in basis.basis]).transpose(1, 2, 0)  # (f, q, 10)
    local = np.argsort(-np.abs(values).max(axis=1), axis=1, kind="stable")[:, :6]  # the others vanish on the facet
    row = np.arange(facets.size)[:, None]
    nodes = np.ascontiguousarray(basis.element_dofs.T[row, local].astype(np.int64))
    if law == "points":
        return _nodal(solid, where, np.unique(nodes))
    slot = where.slot[basis.tind][row[:, :, None], local[:, :, None], local[:, None, :]]
    return Face(
        nodes,
        np.ascontiguousarray(np.take_along_axis(values, local[:, None, :], axis=2)),
        np.ascontiguousarray(basis.dx),
        np.ascontiguousarray(np.asarray(basis.global_coordinates()).transpose(1, 2, 0)),
        np.ascontiguousarray(np.asarray(box).transpose(1, 2, 0)),
        np.ascontiguousarray(slot),
    )


def _nodal(solid: Solid, where: Pattern, nodes: np.ndarray) -> Face:
    """Nodes as contact points that stand for themselves."""
    one = np.ones((nodes.size, 1))
    slot = np.where(where.number[nodes] >= 0, 0, -1).astype(where.slot.dtype)
    return Face(
        nodes[:, None],
        one[:, :, None],
        one,
        np.ascontiguousarray(solid.mesh.doflocs.T[nodes][:, None]),
        np.ascontiguousarray(solid.places.T[nodes][:, None]),
        slot[:, None, None],
    )


@dataclass(frozen=True)
class Obstacle:
    """A rigid body, the law of the contact with it, and the face that may touch it."""

    body: Body
    law: Law
    face: Face

    @property
    def points(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The face's arrays in the order of the kernels."""
        return self.face.nodes, self.face.shape, self.face.weight, self.face.place


@dataclass(frozen=True)
class Touch:
    """What contact remembers between steps: places and slips (f, q, 3) in m of each obstacle's points, energies (J).

    stored: held by the springs. spent: taken by dampers and friction.
    """

    place: tuple[np.ndarray, ...]
    slip: tuple[np.ndarray, ...]
    stored: float
    spent: float


@dataclass(frozen=True)
class Contact:
    """All obstacles of a scene. reach (m): a gap that statics takes for closed."""

    obstacles: tuple[Obstacle, ...]
    reach: float

    def begin(self, displacement: np.ndarray) -> Touch:
        """Nothing has slipped yet at the displacement (n, 3)."""
        slips = tuple(np.zeros_like(obstacle.face.place) for obstacle in self.obstacles)
        unmoved = Touch(tuple(obstacle.face.place for obstacle in self.obstacles), slips, 0.0, 0.0)
        return Stretch(self, unmoved, (0.0, 1.0, self.reach)).settle(displacement)

    def during(self, touch: Touch, length: float, start: float) -> Stretch:
        """A time step of this length (s); see Stretch."""
        return Stretch(self, touch, (1 / length, start, 0.0))

    def at_rest(self, touch: Touch) -> Stretch:
        """A step of statics, where only its end counts."""
        return Stretch(self, touch, (0.0, 1.0, self.reach))

    def now(self, touch: Touch, displacement: np.ndarray, velocity: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Pressure (f, q) and traction (f, q, 3) of the law at one instant, for each obstacle."""
        found = []
        for obstacle, slip in zip(self.obstacles, touch.slip, strict=True):
            pressure, traction = np.empty_like(obstacle.face.weight), np.empty_like(obstacle.face.place)
            contact_kernel.snapshot(
                obstacle.body, obstacle.law.numbers, *obstacle.points, slip, displacement, velocity, pressure, traction
            )
            found.append((pressure, traction))
        return found

    def force_now(self, touch: Touch, displacement: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 3) in N of the law at one instant."""
        force = np.zeros_like(displacement)
        for obstacle, (_, traction) in zip(self.obstacles, self.now(touch, displacement, velocity), strict=True):
            nodes, shape, weight, _ = obstacle.points
            np.add.at(force, nodes, np.einsum("fqa,fq,fqi->fai", shape, weight, traction))
        return force


@dataclass(frozen=True)
class Stretch:
    """The way from a state to the end of a step. path: (1 / h, start, reach); 1 / h = 0 in statics.

    The mean is taken from the fraction `start` of the step on: generalized-alpha balances forces at the fraction
    1 - alpha_f, the middle of what lies behind 1 - 2 alpha_f.
    """

    contact: Contact
    touch: Touch
    path: tuple[float, float, float]

    def force(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean nodal forces (n, 3) in N up to the displacement (n, 3), and the contact's stiffness (n,) at nodes."""
        force, grip = np.zeros_like(displacement), np.zeros(displacement.shape[0])
        for obstacle, before, slip in self._parts():
            contact_kernel.add_force(
                obstacle.body,
                obstacle.law.numbers,
                self.path,
                *obstacle.points,
                before,
                slip,
                displacement,
                force,
                grip,
            )
        return force, grip

    def add_tangent(self, where: Pattern, displacement: np.ndarray, values: np.ndarray) -> None:
        """Add minus the force's derivative (N/m), made symmetric, to the upper-triangle values (nnz,).

        What is left out, the growth of sliding friction with the pressure, costs Newton iterations, not accuracy.
        """
        for obstacle, before, slip in self._parts():
            contact_kernel.add_tangent(
                obstacle.body, obstacle.law.numbers, self.path, *obstacle.points, before, slip, displacement,
                1.0, where.number, where.indptr, obstacle.face.slot, values,
            )  # fmt: skip

    def settle(self, displacement: np.ndarray) -> Touch:
        """What is remembered behind the step that ends with the displacement (n, 3)."""
        places, slips, stored, spent = [], [], 0.0, self.touch.spent
        for obstacle, before, slip in self._parts():
            places.append(np.empty_like(before))
            slips.append(np.empty_like(slip))
            kept, lost = contact_kernel.settle(
                obstacle.body, obstacle.law.numbers, self.path, *obstacle.points, before, slip, displacement,
                places[-1], slips[-1],
            )  # fmt: skip
            stored, spent = stored + kept, spent + lost
        return Touch(tuple(places), tuple(slips), stored, spent)

    def _parts(self):
        return zip(self.contact.obstacles, self.touch.place, self.touch.slip, strict=True)
