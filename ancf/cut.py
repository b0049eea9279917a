"""The rule over a cell that curves cut anywhere: strips along x in which the curves are ordered graphs y(x).

The cell is divided at every abscissa where the order of the curves may change or one of them stops being smooth:
ends of arcs, vertical tangents, knots, crossings with each other and with the sides of the cell. On every vertical
line of Gauss points within a strip the curves are sorted, and between two of them lie Gauss points again, so the
rule is fitted wherever the cut falls; what lies inside a curve is told by counting its arcs below.

A strip's integrand is analytic in x but for branch points of y(x) (see `ancf.arcs`). One that lies at the strip's end
is removed by x = x0 + h s^2; strips are shortened toward others until each is well away from them for its size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from ancf.arcs import Arc, Vertical, crossings
from ancf.quadrature import gauss

ROUND_OFF = 1e-13  # of the coordinates: lines this near to each other are one
AWAY = 0.5  # times a strip's length: how far the next branch point is at least
NEARER = 0.2  # of a strip too near to a branch point: the part that is cut off toward it
SHORTEST = 1e-10  # of the cell's side: a strip this short is not shortened
PLAIN, START, END = 0, -1, 1

Interval = tuple[float, float]
Depth = float | Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Region:
    """What lies inside a closed curve, and how deep it is (m) there.

    lines: x and y across which a varying depth is not smooth. degree: of a varying depth in x and y.
    """

    arcs: tuple[Arc, ...]
    verticals: tuple[Vertical, ...]
    depth: Depth
    lines: tuple[Sequence[float], Sequence[float]] = ((), ())
    degree: tuple[int, int] = (0, 0)


class Cut(NamedTuple):
    """Points (q, 2) and weights (q,) over the cell, and whether each lies inside each region (f, q)."""

    points: np.ndarray
    weights: np.ndarray
    inside: np.ndarray


class Strip(NamedTuple):
    """Part of a cell: its range of x, where a root of the distance begins, and the arcs within it by region."""

    x: Interval
    end: int
    arcs: list[tuple[int, Arc]]
    below: np.ndarray


def rectangle(x: Interval, y: Interval) -> tuple[tuple[Arc, ...], tuple[Vertical, ...]]:
    """Arcs and vertical lines of a rectangle."""
    return tuple(Arc(*x, at, at, at, at) for at in y), tuple(Vertical(at, *y) for at in x)


def inside(arcs: Sequence[Arc], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Whether points (...) lie inside a closed curve: the number of its arcs below is odd."""
    found = np.zeros(np.shape(x), dtype=bool)
    for arc in arcs:
        own = (arc.x0 <= x) & (x < arc.x1) & (arc.low < y)
        if np.any(own):
            found[own] ^= arc.y(x[own]) < y[own]
    return found


def relation(cell, arcs: Sequence[Arc], verticals: Sequence[Vertical]) -> str:
    """What a closed curve is to a cell: it "cuts" it, "covers" it, or lies "outside" to round-off."""
    region = Region(tuple(arcs), tuple(verticals), 0.0)
    tolerance = ROUND_OFF * 10 * scale(cell)
    if _extent(cell, region, tolerance):
        return "outside"
    states = set()
    for strip in strips(cell, [region]):
        middle = np.array([sum(strip.x) / 2])
        y = [float(arc.y(middle)[0]) for _, arc in strip.arcs]
        if any(cell[1][0] + tolerance < value < cell[1][1] - tolerance for value in y):
            return "cuts"
        low = sum(value <= sum(cell[1]) / 2 for value in y) + int(strip.below[0])
        states.add(low % 2)
    return "cuts" if len(states) > 1 else "covers" if states == {1} else "outside"


def _extent(cell, region: Region, tolerance: float) -> bool:
    """Whether the region's box misses the cell."""
    parts = [(a.x0, a.x1, a.low, a.high) for a in region.arcs]
    if not parts:
        return True
    x0, x1, low, high = np.array(parts).T
    (left, right), (down, up) = cell
    return bool(
        x1.max() <= left + tolerance
        or x0.min() >= right - tolerance
        or high.max() <= down + tolerance
        or low.min() >= up - tolerance
    )


def scale(cell) -> float:
    """Largest coordinate of a cell: what round-off is measured against."""
    return max(abs(value) for side in cell for value in side)


def cut(cell, regions: Sequence[Region], counts: tuple[int, int, int]) -> Cut:
    """Rule over a cell with at least counts[0] x counts[1] Gauss points in each part of each strip.

    Along x and y there are as many as the degree of the curves and depths asks for, so that between straight lines a
    polynomial of degree 2 counts - 1 in x, y and z is integrated exactly over columns that end at the depths.
    """
    varying = [region for region in regions if callable(region.depth)]
    deep = [max((region.degree[axis] for region in varying), default=0) for axis in (0, 1)]
    along_y = gauss(counts[1] + counts[2] * deep[1])
    parts = [_part(cell, regions, strip, counts, deep, along_y) for strip in strips(cell, regions)]
    return Cut(*(np.concatenate([part[k] for part in parts], axis=0 if k < 2 else 1) for k in range(3)))


def _part(cell, regions, strip: Strip, counts, deep, along_y) -> Cut:
    """The rule over one strip."""
    degree = max((arc.degree for _, arc in strip.arcs), default=0)
    count = counts[0] + degree * counts[1] + counts[2] * (deep[0] + degree * deep[1])
    x, weights = _abscissae(strip, count + counts[0] * abs(strip.end))
    y, state = rows(cell, regions, strip, x)
    half = np.diff(y, axis=0)[..., None] / 2
    at = y[:-1, :, None] + half * (1 + along_y.points[:, 0])
    weight = weights[:, None] * half * along_y.weights
    some = np.broadcast_to(half > 0, at.shape)
    points = np.stack([np.broadcast_to(x[:, None], at.shape)[some], at[some]], axis=1)
    inside = np.broadcast_to(state[..., None], (*state.shape, at.shape[2]))[:, some]
    return Cut(points, weight[some], inside)


def _abscissae(strip: Strip, count: int) -> tuple[np.ndarray, np.ndarray]:
    (left, right), line = strip.x, gauss(count)
    s, weights, width = (1 + line.points[:, 0]) / 2, line.weights / 2, right - left
    if strip.end == PLAIN:
        return left + width * s, width * weights
    along = width * s**2
    return (left + along if strip.end == START else right - along), 2 * width * s * weights


def rows(cell, regions, strip: Strip, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sorted ordinates (k, q) from side to side, and whether what is between two lies in a region (f, k - 1, q)."""
    low, high = cell[1]
    lines = sorted({y for region in regions for y in region.lines[1] if low < y < high})
    y = np.array([*(arc.y(x) for _, arc in strip.arcs), *(np.full_like(x, line) for line in lines)])
    y = np.clip(y.reshape(-1, len(x)), low, high)
    owner = np.array([f for f, _ in strip.arcs] + [-1] * len(lines), dtype=int)
    order = np.argsort(y, axis=0, kind="stable")
    y, owner = np.take_along_axis(y, order, axis=0), owner[order].reshape(-1, len(x))
    toggles = owner[None] == np.arange(len(regions))[:, None, None]
    counts = strip.below[:, None, None] + np.cumsum(toggles, axis=1)
    first = np.broadcast_to(strip.below[:, None, None], (len(regions), 1, len(x)))
    y = np.concatenate([np.full((1, len(x)), low), y, np.full((1, len(x)), high)])
    return y, np.concatenate([first, counts], axis=1) % 2 == 1


def strips(cell, regions: Sequence[Region]) -> Iterator[Strip]:
    """The strips of a cell from left to right."""
    (left, right), (low, high) = cell
    near = [[arc for arc in region.arcs if arc.x0 < right and arc.x1 > left and arc.low < high] for region in regions]
    within = [[arc for arc in own if arc.high > low] for own in near]
    tolerance = ROUND_OFF * scale(cell)
    marks = _marks(cell, regions, within, tolerance)
    floor = max(SHORTEST * (right - left), 4 * tolerance)
    for start, end in pairwise(marks):
        middle = (start + end) / 2
        active = [(f, arc) for f, own in enumerate(within) for arc in own if arc.x0 < middle < arc.x1]
        below = np.array([sum(arc.high <= low and arc.x0 < middle < arc.x1 for arc in own) for own in near])
        at = [float(arc.y(np.array(middle))) for _, arc in active]
        seen = [pair for pair, y in zip(active, at, strict=True) if low < y < high]
        for (f, _), y in zip(active, at, strict=True):
            below[f] += y <= low
        for x, side in _shortened(start, end, [arc for _, arc in seen if arc.homogeneous is not None], floor):
            yield Strip(x, side, seen, below)


def _marks(cell, regions, within, tolerance: float) -> list[float]:
    """Increasing abscissae between which no curve begins, ends or crosses another."""
    (left, right), (low, high) = cell
    found = [x for region in regions for x in region.lines[0]]
    levels = {low, high, *(y for region in regions for y in region.lines[1])}
    for own, region in zip(within, regions, strict=True):
        found += [v.x for v in region.verticals if v.low < high and v.high > low]
        for arc in own:
            found += [arc.x0, arc.x1]
            for level in levels:
                if arc.low < level < arc.high:
                    found += arc.meets(0.0, 1.0, level).tolist()
    for one, other in combinations(within, 2):
        found += crossings(one, other)
    marks = [left]
    for x in sorted(x for x in found if left < x < right - tolerance):
        if x > marks[-1] + tolerance:
            marks.append(x)
    return [*marks, right]


def _shortened(left: float, right: float, arcs: Sequence[Arc], floor: float) -> Iterator[tuple[Interval, int]]:
    """Parts of a strip that are short beside the distance of every branch point of its arcs."""
    waiting = [(left, right)]
    while waiting:
        start, end = waiting.pop()
        sides = _vertical_sides(start, end, arcs, floor)
        place = _too_near(start, end, arcs, floor) if end - start > floor else None
        if place is None and len(sides) == 2:
            place = (start + end) / 2
        if place is None:
            yield (start, end), (sides or [PLAIN])[0]
        else:
            waiting += [(place, end), (start, place)]


def _vertical_sides(start: float, end: float, arcs: Sequence[Arc], floor: float) -> list[int]:
    """The ends of a strip, START or END, at which an arc has a vertical tangent."""
    found = []
    for side, x, k in ((START, start, 0), (END, end, 1)):
        ends = (arc for arc in arcs if arc.vertical[k])
        if any(abs((arc.x0, arc.x1)[k] - x) <= floor for arc in ends):
            found.append(side)
    return found


def _too_near(start: float, end: float, arcs: Sequence[Arc], floor: float) -> float | None:
    """Where to divide a strip that is long beside its distance from a branch point; None where it is not."""
    for arc in arcs:
        ends = [x for x, at, vertical in zip((arc.x0, arc.x1), (start, end), arc.vertical, strict=True)
                if vertical and abs(x - at) > floor]  # fmt: skip
        branches = np.concatenate([arc.branches, ends])
        distance = np.abs(branches - np.clip(branches.real, start, end))
        if len(branches) and distance.min() < AWAY * (end - start):
            share = (branches[np.argmin(distance)].real - start) / (end - start)
            return start + float(np.clip(share, NEARER, 1 - NEARER)) * (end - start)
    return None
