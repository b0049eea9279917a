"""Tread patterns of Table 1 of the paper, as grooves of a plate: rock, traction, block, rib, smooth.

A pattern is stated by its kind, its depth, how often it repeats along the direction of travel and the part of the
face that it takes away, not in metres: so the same tread lies on a plate or goes round a tire, and closes there.
Below, s runs along the direction of travel and t across it, both from 0 to 1 over the whole mid-surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from compare.scene_parts import Count, Interval, Part, Positive

PREFIX = "tread "
CENTRE_RIB = 0.12  # of the width: the rib that the bars of a traction tread leave
SLANT = 0.8  # pitches that a bar of a traction tread trails behind from its inner to its outer end
REACH = 0.46  # of the width: how far the slots of a rock tread reach in from the shoulders
SWING = 0.12  # pitches that the slots of a rock tread swing to and fro
WEAR = 0.12  # of the width: where the wear groove of a smooth tread lies

Point = tuple[float, float]


class Tread(Part):
    """A tread pattern on one face.

    rock: narrow curved slots from both shoulders, by turns. traction: bars that point forward like a V, with a rib
    between them. block: rows of staggered blocks. rib: grooves along the direction of travel. smooth: one narrow
    groove near an edge, to measure wear by. along: the direction of travel. pitches: repetitions along it (rock,
    traction, block). ribs: of a rib tread, or rows of blocks. void: the part of the face that is cut away. across: the
    range that the tread takes up across the direction of travel, in the parameter of the mid-surface, as the crown of a
    tire between its shoulders; it may reach beyond an edge, as where a half stands for the whole. Without it all.
    """

    kind: Literal["rock", "traction", "block", "rib", "smooth"]
    face: Literal["bottom", "top"]
    along: Literal["x", "y"] = "x"
    depth: Positive
    void: Annotated[Positive, Field(lt=1)]
    pitches: Count = 4
    ribs: Count = 4
    across: Interval | None = None


def title(name: str) -> str:
    """Short name of a groove: those of a tread share one."""
    return name.rsplit(" ", 1)[0] if name.startswith(PREFIX) else name


def grooves(tread: Tread, span: tuple[Interval, Interval]) -> list[dict[str, Any]]:
    """The tread's grooves as a scene states them, over the ranges `span` of x and y."""
    place, found = _place(tread, span), []
    low, high = span["xy".index(_across(tread))]
    for shape in PATTERNS[tread.kind](tread):
        stated = {"name": f"{PREFIX}{tread.kind} {len(found) + 1}", "face": tread.face, "depth": tread.depth}
        if isinstance(shape, tuple):
            ends = sorted(place((0.0, t))["xy".index(_across(tread))] for t in shape)
            made = {"along": tread.along, "across": [max(ends[0], low), min(ends[1], high)]}
        else:
            points = [place(point) for point in shape["control_points"]]
            ends = sorted(point["xy".index(_across(tread))] for point in points)
            made = {"outline": {**shape, "control_points": [*points, points[0]]}}
        if tread.across is None or (ends[0] < high and ends[-1] > low):
            found.append(stated | made)
    return found


def _across(tread: Tread) -> str:
    return "y" if tread.along == "x" else "x"


def _place(tread: Tread, span: tuple[Interval, Interval]) -> Callable[[Point], Point]:
    """From (s, t) to (x, y)."""
    if tread.across is not None:
        span = (span[0], tread.across) if tread.along == "x" else (tread.across, span[1])
    (x0, x1), (y0, y1) = span

    def place(point: Point) -> Point:
        u, v = point if tread.along == "x" else point[::-1]
        return x0 + u * (x1 - x0), y0 + v * (y1 - y0)

    return place


Shape = tuple[float, float] | dict[str, Any]


def _rib(tread: Tread) -> Iterator[Shape]:
    """Bands between equally wide ribs."""
    count = max(tread.ribs - 1, 1)
    width, rib = tread.void / count, (1 - tread.void) / (count + 1)
    for i in range(count):
        start = (i + 1) * rib + i * width
        yield start, start + width


def _smooth(tread: Tread) -> Iterator[Shape]:
    yield WEAR, WEAR + tread.void


def _traction(tread: Tread) -> Iterator[Shape]:
    """Two bars a pitch, from the centre rib to the shoulders; a part of a bar that the end cuts off begins anew."""
    pitch, half = 1 / tread.pitches, (1 - CENTRE_RIB) / 2
    width = tread.void / (2 * half * tread.pitches)
    for i in range(tread.pitches + 1):
        tip = (i + 0.5) * pitch
        for inner, outer in ((half, 0.0), (1 - half, 1.0)):
            tail = tip - SLANT * pitch
            if tail < 1 and tip + width > 0:
                # beyond the shoulder by a tenth, so that the bar's end does not lie in the plate's edge
                past, beyond = tail - 0.1 * SLANT * pitch, outer + 0.1 * (outer - inner)
                yield _polygon((tip, inner), (tip + width, inner), (past + width, beyond), (past, beyond))


def _block(tread: Tread) -> Iterator[Shape]:
    """Bands between rows, and across each row rectangles that are staggered from row to row."""
    part = 1 - (1 - tread.void) ** 0.5  # along and across alike
    count = max(tread.ribs - 1, 1)
    wide, row = part / count, (1 - part) / (count + 1)
    pitch, long = 1 / tread.pitches, part / tread.pitches
    yield from ((start, start + wide) for start in ((i + 1) * row + i * wide for i in range(count)))
    for j in range(count + 1):
        low = j * (row + wide)
        low, high = (low - wide / 2 if j else -row / 4), (low + row + wide / 2 if j < count else 1 + row / 4)
        for i in range(tread.pitches):
            start = (i + (0.25 if j % 2 else 0.75)) * pitch - long / 2
            yield _polygon((start, low), (start + long, low), (start + long, high), (start, high))


def _rock(tread: Tread) -> Iterator[Shape]:
    """Slots of constant width along s, between two equal curves s(t) of degree 2."""
    pitch = 1 / tread.pitches
    width = tread.void / (2 * REACH * tread.pitches)
    for i in range(tread.pitches):
        for start, inner in ((0.25, REACH), (0.75, 1 - REACH)):
            outer = 0.0 if start < 0.5 else 1.0
            beyond = outer + 0.1 * (outer - inner)
            s = (i + start) * pitch - width / 2
            swing = SWING * pitch
            curve = [(s, beyond), (s, outer), (s + swing, (outer + inner) / 2), (s - swing, inner)]
            yield _slot(curve, width)


def _polygon(*points: Point) -> dict[str, Any]:
    """A closed polygon without its last point."""
    n = len(points)
    return {"degree": 1, "knots": [0.0, *map(float, range(n + 1)), float(n)], "control_points": list(points)}


def _slot(curve: list[Point], width: float) -> dict[str, Any]:
    """A closed curve of degree 2, without its last point: a side of four control points, an end, the other, an end."""
    other = [(s + width, t) for s, t in reversed(curve)]
    ends = [_middle(curve[-1], other[0]), _middle(other[-1], curve[0])]
    points = [*curve, ends[0], *other, ends[1]]
    knots = [0, 0, 0, 1, 2, 2, 3, 3, 4, 5, 5, 6, 6, 6]
    return {"degree": 2, "knots": [float(knot) for knot in knots], "control_points": points}


def _middle(p: Point, q: Point) -> Point:
    return (p[0] + q[0]) / 2, (p[1] + q[1]) / 2


PATTERNS: dict[str, Callable[[Tread], Iterator[Shape]]] = {
    "rock": _rock,
    "traction": _traction,
    "block": _block,
    "rib": _rib,
    "smooth": _smooth,
}
