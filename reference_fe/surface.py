"""Mid-surface, NURBS or revolved, evaluated by OCC through gmsh: position, normal and volume element."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from reference_fe.geometry import Curve, MeshError, session

SAMPLES = 33

Interval = tuple[float, float]


@dataclass(frozen=True)
class Frame:
    """From the plate's parameters (x, y) to box coordinates (m): scale x (parameter - origin)."""

    origin: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)

    def interval(self, axis: int, values: Interval) -> Interval:
        """A range of parameters along an axis, in the box."""
        return tuple(self.scale[axis] * (value - self.origin[axis]) for value in values)

    def region(self, region: tuple[Interval, Interval]) -> tuple[Interval, Interval]:
        """A region ((x0, x1), (y0, y1)) in the box."""
        return self.interval(0, region[0]), self.interval(1, region[1])

    def place(self, at: tuple[float, float]) -> tuple[float, float]:
        """A point (x, y) in the box."""
        return self.interval(0, at[:1]) + self.interval(1, at[1:2])


@dataclass(frozen=True)
class Surface:
    """NURBS mid-surface (paper Eq. 4): points (n, m, 3) in m, weights (n, m), flat knots of each direction.

    frame: where its parameters lie in the box.
    """

    degree: tuple[int, int]
    knots: tuple[np.ndarray, np.ndarray]
    points: np.ndarray
    weights: np.ndarray
    frame: Frame = Frame()

    @property
    def spans(self) -> tuple[Interval, Interval]:
        """Ranges of both parameters."""
        return tuple((knots[0], knots[-1]) for knots in self.knots)

    def parameters(self, box: np.ndarray) -> np.ndarray:
        """Parameters (k, 2) at box points (3, k), kept within the knots against round-off."""
        start, end = np.array(self.spans).T
        return np.clip(self.frame.origin + box[:2].T / self.frame.scale, start, end)

    def creases(self, axis: int) -> np.ndarray:
        """Interior knots (box coordinates, m) where the surface is only continuous, not smooth."""
        return np.array(self.frame.interval(axis, _sharp(self.knots[axis], self.degree[axis])))

    def add(self, gmsh: ModuleType) -> int:
        """The surface as an OCC face of gmsh's current model; returns its tag."""
        n, occ = self.points.shape[0], gmsh.model.occ
        tags = [occ.addPoint(*point) for point in self.points.transpose(1, 0, 2).reshape(-1, 3)]
        (u, u_count), (v, v_count) = (np.unique(knots, return_counts=True) for knots in self.knots)
        return occ.addBSplineSurface(tags, n, -1, *self.degree, self.weights.T.ravel(), u, v, u_count, v_count)


@dataclass(frozen=True)
class Revolved:
    """A section turned about an axis of space through its origin: x is the angle, y the section's parameter.

    axis: 0, 1, 2 for X, Y, Z. angle: range (rad) of x, measured from the next axis in turn toward the one after that.
    section: points (n, 2) = (along the axis, away from it) in m. frame: where the parameters lie in the box.
    """

    axis: int
    angle: Interval
    section: Curve
    frame: Frame = Frame()

    @property
    def spans(self) -> tuple[Interval, Interval]:
        """Ranges of OCC's parameters: the angle from the first one on, and the section's own."""
        return (0.0, self.angle[1] - self.angle[0]), (self.section.knots[0], self.section.knots[-1])

    def parameters(self, box: np.ndarray) -> np.ndarray:
        """OCC's parameters (k, 2) at box points (3, k), kept within their ranges against round-off."""
        start, end = np.array(self.spans).T
        return np.clip((0.0, self.frame.origin[1]) + box[:2].T / self.frame.scale, start, end)

    def creases(self, axis: int) -> np.ndarray:
        """As of a `Surface`; along the angle there are none."""
        sharp = np.empty(0) if axis == 0 else _sharp(self.section.knots, self.section.degree)
        return np.array(self.frame.interval(axis, sharp))

    def add(self, gmsh: ModuleType) -> int:
        """The surface as an OCC face of gmsh's current model; returns its tag."""
        occ, section = gmsh.model.occ, self.section
        A, B, C = np.roll(np.eye(3), -self.axis, axis=0)
        out = np.cos(self.angle[0]) * B + np.sin(self.angle[0]) * C
        tags = [occ.addPoint(*(along * A + radius * out)) for along, radius in section.points]
        knots, count = np.unique(section.knots, return_counts=True)
        curve = occ.addBSpline(tags, -1, section.degree, section.weights, knots, count)
        swept = occ.revolve([(1, curve)], 0, 0, 0, *A, self.angle[1] - self.angle[0])
        return next(tag for dimension, tag in swept if dimension == 2)


def _sharp(knots: np.ndarray, degree: int) -> np.ndarray:
    """Interior knots at which a spline is only continuous."""
    distinct, count = np.unique(knots, return_counts=True)
    return distinct[1:-1][count[1:-1] >= degree]


def lengths(surface: Surface | Revolved) -> tuple[float, float]:
    """Mean metres per unit of the two parameters: mean sizes of S_x and S_y over the surface."""
    grids = [np.linspace(*span, SAMPLES + 2)[1:-1] for span in surface.spans]
    parameters = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1).reshape(-1, 2)
    with session() as gmsh:
        _, S_x, S_y = _evaluate(gmsh, _add(gmsh, surface), parameters)
    return float(np.linalg.norm(S_x, axis=1).mean()), float(np.linalg.norm(S_y, axis=1).mean())


def carry(surface: Surface | Revolved, box: np.ndarray) -> np.ndarray:
    """Points (3, k) in space, X = S(x, y) + z n(x, y), of box points (3, k).

    Raises MeshError "surface_degenerate" where the surface has no normal.
    """
    with session() as gmsh:
        S, S_x, S_y = _evaluate(gmsh, _add(gmsh, surface), surface.parameters(box))
    return (S + box[2][:, None] * _normal(S_x, S_y)[0]).T


def volume_element(surface: Surface | Revolved, box: np.ndarray) -> np.ndarray:
    """Volume in space per volume in the box (k,) at box points (3, k).

    |S_x x S_y| (1 - 2 H z + K z²) with the mean and Gaussian curvature H, K of the surface
    (do Carmo, Differential Geometry of Curves and Surfaces, section 3-5).
    """
    with session() as gmsh:
        tag, parameters = _add(gmsh, surface), surface.parameters(box)
        _, S_x, S_y = _evaluate(gmsh, tag, parameters)
        second = gmsh.model.getSecondDerivative(2, tag, parameters.ravel()).reshape(-1, 3, 3)
    normal, area = _normal(S_x, S_y)
    S_xx, S_yy, S_xy = (np.sum(second[:, k] * normal, axis=1) for k in range(3))
    E, F, G = np.sum(S_x * S_x, axis=1), np.sum(S_x * S_y, axis=1), np.sum(S_y * S_y, axis=1)
    mean = (E * S_yy - 2 * F * S_xy + G * S_xx) / (2 * area**2)
    gauss = (S_xx * S_yy - S_xy**2) / area**2
    return area * (1 - 2 * mean * box[2] + gauss * box[2] ** 2) / np.prod(surface.frame.scale)


def _add(gmsh: ModuleType, surface: Surface | Revolved) -> int:
    """The surface as an OCC face of gmsh's current model; returns its tag."""
    try:
        tag = surface.add(gmsh)
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise MeshError("geometry_failed", f"OCC cannot build the mid-surface: {error}") from error
    return tag


def _evaluate(gmsh: ModuleType, tag: int, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position and both derivatives, (k, 3) each, at parameters (k, 2)."""
    position = gmsh.model.getValue(2, tag, parameters.ravel()).reshape(-1, 3)
    derivative = gmsh.model.getDerivative(2, tag, parameters.ravel()).reshape(-1, 2, 3)
    return position, derivative[:, 0], derivative[:, 1]


def _normal(S_x: np.ndarray, S_y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (k, 3) and areas |S_x x S_y| (k,)."""
    normal = np.cross(S_x, S_y)
    area = np.linalg.norm(normal, axis=1)
    if not area.min() > 1e-10 * area.max():
        raise MeshError("surface_degenerate", "the mid-surface has a point without a normal")
    return normal / area[:, None], area
