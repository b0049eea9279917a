"""A closed NURBS curve in the plane as graphs y(x): arcs, where they begin and end, and where they cross.

Between two knots a curve is a ratio of polynomials in t in [0, 1]: x = X / W, y = Y / W. It is divided where
x' = 0, so that on each arc x is monotone and y a function of x. That function is analytic but for branch points,
the images of the complex roots of x': at a vertical tangent it grows like the root of the distance, and beside one
it is nearly so. An arc carries those roots, because a rule over x must know how near they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import factorial

import numpy as np
from numpy.polynomial import polynomial as power

from ancf.nurbs import Curve

STRAIGHT = 1e-14  # of a curve's size: how far a straight line may bend
AT_END = 1e-12  # of the parameter: a root this near to an end of an arc lies on it
NEAR_END = 1e-6  # of an arc's parameters: a second root of x' this near to an end makes it more than a plain turn
REAL = 1e-7  # imaginary part of a root that is real
FAR = 3.0  # arc lengths: branch points this far away do not matter
STEPS = 24  # along a line to a branch point
ITERATIONS = 80
SMALL = 1e-3  # of an arc: from pieces of this size on Newton's iteration finds a crossing
MOST_PAIRS = 4000  # of pieces, before two arcs are taken to coincide
NO_ROOTS = np.empty(0, dtype=complex)


@dataclass(frozen=True, eq=False)
class Arc:
    """Part of a curve along which x increases from x0 to x1 and y is a function of it.

    homogeneous (3, p + 1): coefficients of X, Y, W in powers of t, or None for a straight line. t0, t1: parameters
    of its ends. low, high: range of y. branches: the branch points x of y(x) near the arc, but for a simple one at an
    end, where the tangent is then `vertical` (start, end).
    """

    x0: float
    x1: float
    y0: float
    y1: float
    low: float
    high: float
    homogeneous: np.ndarray | None = None
    t0: float = 0.0
    t1: float = 1.0
    branches: np.ndarray = field(default_factory=lambda: NO_ROOTS)
    vertical: tuple[bool, bool] = (False, False)

    @property
    def degree(self) -> int:
        """Degree of the curve; 0 where it is a line of constant y."""
        if self.homogeneous is None:
            return 0 if self.y0 == self.y1 else 1
        return self.homogeneous.shape[1] - 1

    def parameter(self, x: np.ndarray) -> np.ndarray:
        """t at the abscissae x, clipped to the arc: Newton's iteration, by bisection where that leaves its bracket."""
        x = np.clip(np.asarray(x, dtype=float), self.x0, self.x1)
        if self.homogeneous is None:
            return (x - self.x0) / (self.x1 - self.x0)
        X, W = self.homogeneous[0], self.homogeneous[2]
        low, high = np.full(x.shape, self.t0), np.full(x.shape, self.t1)
        t = low + (high - low) * (x - self.x0) / (self.x1 - self.x0)
        X_t, W_t, eps = power.polyder(X), power.polyder(W), np.finfo(float).eps
        for _ in range(ITERATIONS):
            above, weight = _value(X, t), _value(W, t)
            F, slope = above - x * weight, _value(X_t, t) - x * _value(W_t, t)
            below = (F <= 0) == (weight > 0)
            low, high = np.where(below, t, low), np.where(below, high, t)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = t - F / slope
            found = np.abs(F) <= eps * np.abs(above)
            new = np.where(found, t, np.where((new - low) * (new - high) <= 0, new, (low + high) / 2))
            found |= np.abs(new - t) <= 4 * eps * np.abs(t)
            t = new
            if found.all():
                break
        return t

    def y(self, x: np.ndarray) -> np.ndarray:
        """y at the abscissae x, clipped to the arc."""
        t = self.parameter(x)
        if self.homogeneous is None:
            return self.y0 + t * (self.y1 - self.y0)
        return _value(self.homogeneous[1], t) / _value(self.homogeneous[2], t)

    def at(self, t: np.ndarray) -> np.ndarray:
        """Points (..., 2) at parameters t."""
        if self.homogeneous is None:
            t = np.asarray(t)[..., None]
            return (1 - t) * (self.x0, self.y0) + t * np.array([self.x1, self.y1])
        X, Y, W = (_value(c, t) for c in self.homogeneous)
        return np.stack([X / W, Y / W], axis=-1)

    def meets(self, a: float, b: float, c: float) -> np.ndarray:
        """Abscissae at which the arc meets the line a x + b y = c."""
        if self.homogeneous is None:
            first, last = a * self.x0 + b * self.y0 - c, a * self.x1 + b * self.y1 - c
            if first == last or first * last > 0:
                return np.empty(0)
            return np.array([self.x0 + (self.x1 - self.x0) * first / (first - last)])
        X, Y, W = self.homogeneous
        t = _within(_roots(a * X + b * Y - c * W), *sorted((self.t0, self.t1)))
        return np.clip(self.at(t)[..., 0], self.x0, self.x1)


@dataclass(frozen=True)
class Vertical:
    """A part of a curve with constant x."""

    x: float
    low: float
    high: float


def _value(coefficients: np.ndarray, t: np.ndarray) -> np.ndarray:
    """A polynomial at t, by Horner's rule."""
    *lower, total = coefficients.tolist()
    for coefficient in reversed(lower):
        total = total * t + coefficient
    return total + 0 * t


def _roots(coefficients: np.ndarray) -> np.ndarray:
    """Complex roots of a polynomial in t; none of one that vanishes."""
    largest = np.abs(coefficients).max()
    kept = np.flatnonzero(np.abs(coefficients) > 1e-15 * largest) if largest > 0 else []
    return power.polyroots(coefficients[: kept[-1] + 1]) if len(kept) else NO_ROOTS


def _within(roots: np.ndarray, low: float, high: float) -> np.ndarray:
    """The real roots between low and high, ends included."""
    t = roots[np.abs(roots.imag) < REAL].real
    return np.clip(t[(t > low - AT_END) & (t < high + AT_END)], low, high)


def divide(curve: Curve) -> tuple[tuple[Arc, ...], tuple[Vertical, ...]]:
    """Arcs and vertical lines of a closed curve, in its order; neighbours share their ends to the last digit."""
    arcs, verticals, size = [], [], np.ptp(curve.control_points, axis=0).max()
    spans = list(_spans(curve))
    for (homogeneous, start), (_, end) in zip(spans, [*spans[1:], spans[0]], strict=True):
        for arc in _monotone(homogeneous, start, end, size):
            (verticals if isinstance(arc, Vertical) else arcs).append(arc)
    return tuple(arcs), tuple(verticals)


def _spans(curve: Curve) -> Iterable[tuple[np.ndarray, np.ndarray]]:
    """Coefficients (3, p + 1) of (X, Y, W) in powers of t from knot to knot, and the first point (2,) of each."""
    for first, last in pairwise(curve.breaks):
        taylor = [curve.homogeneous(first, nu=k) * (last - first) ** k / factorial(k) for k in range(curve.degree + 1)]
        homogeneous = np.array(taylor).T
        yield homogeneous, homogeneous[:2, 0] / homogeneous[2, 0]


def _monotone(homogeneous: np.ndarray, start: np.ndarray, end: np.ndarray, size: float) -> Iterable[Arc | Vertical]:
    """The parts of a span along which x is monotone."""
    X, Y, W = homogeneous
    if np.abs(power.polysub(X, start[0] * W)).max() <= STRAIGHT * size * np.abs(W).max():
        yield Vertical(float(start[0]), float(min(start[1], end[1])), float(max(start[1], end[1])))
        return
    roots = _roots(_turning(X, W))
    inner = np.unique(_within(roots, 0.0, 1.0))
    cuts = [0.0, *inner[(inner > AT_END) & (inner < 1 - AT_END)], 1.0]
    points = [start, *(np.array([_value(c, t) for c in (X, Y)]) / _value(W, t) for t in cuts[1:-1]), end]
    for (t0, t1), (p, q) in zip(pairwise(cuts), pairwise(points), strict=True):
        if p[0] == q[0]:
            continue
        if p[0] > q[0]:
            t0, t1, p, q = t1, t0, q, p
        yield _arc(homogeneous, (t0, t1), p, q, roots, size)


def _turning(X: np.ndarray, W: np.ndarray) -> np.ndarray:
    """X' W - X W', the numerator of (X / W)'."""
    return power.polysub(power.polymul(power.polyder(X), W), power.polymul(X, power.polyder(W)))


def _arc(homogeneous, t: tuple[float, float], p: np.ndarray, q: np.ndarray, roots: np.ndarray, size: float) -> Arc:
    X, Y, W = homogeneous
    ends = *map(float, (p[0], q[0])), *map(float, (p[1], q[1]))
    d = q - p
    bend = power.polysub(d[1] * power.polysub(X, p[0] * W), d[0] * power.polysub(Y, p[1] * W))
    if np.abs(bend).max() <= STRAIGHT * size * np.abs(d).max() * np.abs(W).max():
        return Arc(*ends, min(ends[2:]), max(ends[2:]))
    low, high = min(t), max(t)
    extremes = _within(_roots(_turning(Y, W)), low, high)
    ys = [*ends[2:], *(_value(Y, extremes) / _value(W, extremes))]
    vertical = []
    for end in t:
        here = np.abs(roots - end) < NEAR_END * (high - low)
        vertical.append(bool(np.count_nonzero(here) == 1))
        roots = roots[~here] if vertical[-1] else roots
    branches = _branches(homogeneous, t, ends[:2], roots)
    return Arc(*ends, float(min(ys)), float(max(ys)), homogeneous, *t, branches, tuple(vertical))


def _branches(homogeneous, t: tuple[float, float], x: tuple[float, float], roots: np.ndarray) -> np.ndarray:
    """The images of roots of x' that are singular points of y(x) as it is on the arc, near enough to matter.

    One of another sheet is no singular point here: the parameter is followed along a line in the complex plane of x
    from the nearest point of the arc, and ends at the root or elsewhere.
    """
    X, _, W = homogeneous
    weight = _value(W, roots)
    roots, weight = roots[np.abs(weight) > 0], weight[np.abs(weight) > 0]
    images = _value(X, roots) / weight
    start = np.clip(images.real, *x)
    near = np.abs(images - start) < FAR * (x[1] - x[0])
    roots, images, start = roots[near], images[near], start[near]
    if not len(roots):
        return roots
    first = Arc(*x, 0.0, 0.0, 0.0, 0.0, homogeneous, *t).parameter(start)
    at, X_t, W_t = first.astype(complex), power.polyder(X), power.polyder(W)
    for step in np.linspace(0, 0.98, STEPS):
        to = start + step * (images - start)
        for _ in range(4):
            F, slope = _value(X, at) - to * _value(W, at), _value(X_t, at) - to * _value(W_t, at)
            at = at - np.divide(F, slope, out=np.zeros_like(F), where=slope != 0)
    return images[np.abs(at - roots) <= np.abs(first - roots) / 2]


def crossings(first: Sequence[Arc], second: Sequence[Arc]) -> list[float]:
    """Abscissae at which arcs of one curve cross those of another. Where two coincide there are none."""
    if not first or not second:
        return []
    one, other = (np.array([(a.x0, a.x1, a.low, a.high) for a in arcs]).T[..., None] for arcs in (first, second))
    other = other.swapaxes(1, 2)
    overlap = (one[0] <= other[1]) & (other[0] <= one[1]) & (one[2] <= other[3]) & (other[2] <= one[3])
    found = []
    for i, j in np.argwhere(overlap):
        a, b = first[i], second[j]
        if a.homogeneous is None or b.homogeneous is None:
            a, b = (a, b) if b.homogeneous is None else (b, a)
            x = a.meets(b.y1 - b.y0, b.x0 - b.x1, b.x0 * (b.y1 - b.y0) - b.y0 * (b.x1 - b.x0))
            found += x[(x >= b.x0) & (x <= b.x1)].tolist()
        else:
            found += _curved_crossings(a, b)
    return found


def _curved_crossings(a: Arc, b: Arc) -> list[float]:
    """Crossings of two curved arcs: boxes of ever smaller pieces, then Newton's iteration."""
    waiting, found, tried = [(s, t) for s in _boxes(a) for t in _boxes(b)], [], 0
    while waiting and tried < MOST_PAIRS:
        (s0, s1), (t0, t1) = waiting.pop()
        tried += 1
        p, q = a.at(np.array([s0, s1])), b.at(np.array([t0, t1]))
        if np.any(p.max(axis=0) < q.min(axis=0)) or np.any(q.max(axis=0) < p.min(axis=0)):
            continue
        if max(abs(s1 - s0), abs(t1 - t0)) > SMALL:
            s, t = (s0 + s1) / 2, (t0 + t1) / 2
            waiting += [(u, v) for u in ((s0, s), (s, s1)) for v in ((t0, t), (t, t1))]
        elif (x := _newton(a, b, (s0 + s1) / 2, (t0 + t1) / 2)) is not None:
            found.append(x)
    return found if tried < MOST_PAIRS else []


def _boxes(arc: Arc) -> list[tuple[float, float]]:
    """Parameter ranges along which y is monotone too, so that the ends of each make its box."""
    low, high = sorted((arc.t0, arc.t1))
    return list(pairwise(np.unique([low, high, *_within(_roots(_turning(*arc.homogeneous[1:])), low, high)])))


def _newton(a: Arc, b: Arc, s: float, t: float) -> float | None:
    """Abscissa of the crossing near the parameters s and t, None where there is none."""
    for _ in range(30):
        (p, p_s), (q, q_t) = ((arc.at(np.array(u)), _tangent(arc, u)) for arc, u in ((a, s), (b, t)))
        try:
            ds, dt = np.linalg.solve(np.column_stack([p_s, -q_t]), q - p)
        except np.linalg.LinAlgError:
            return None
        s, t = s + float(np.clip(ds, -0.1, 0.1)), t + float(np.clip(dt, -0.1, 0.1))
        if max(abs(ds), abs(dt)) < 1e-14:
            break
    x = float(a.at(np.array(s))[0])
    return x if max(a.x0, b.x0) <= x <= min(a.x1, b.x1) else None


def _tangent(arc: Arc, t: float) -> np.ndarray:
    X, Y, W = arc.homogeneous
    return np.array([_value(_turning(c, W), t) for c in (X, Y)]) / _value(W, t) ** 2
