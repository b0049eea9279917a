"""Wall functions: the position field may kink where the floor of a groove or the top of a protrusion begins or ends.

Beside such a line the thickness jumps, and with it the strains that carry the same forces: a floor of half the
thickness bends eight times as easily. Cubics and a bilinear director are smooth inside an element, so an element that
a groove crosses is too stiff by far unless grid lines stand on the walls. A wall function lets it kink there. With the
coordinate y across the band in the element from y0 to y1, the wall at y = w, and L(x) one of the two linear functions
along it, an element has the displacements

    h(y) L(x) r_w,    z h(y) L(x) d_w,    h = min((y - y0) / (w - y0), (y1 - y) / (y1 - w)):

those of the mid-surface and of the director. They vanish on the element's sides along the band and are shared with the
next element on the grid line across it: the field stays continuous. The reference vectors are zero, on flat and curved
plates alike. What is right of a wall and what is left of it are smooth, and rules divide elements there anyhow.

With lips, the material beyond the floor, which ends at the wall with a free face, may stay behind what is below it:

    e(d) L(x) T(z) l_w,    T = min(0, z - z_floor)    (max for the top face),

with the distance d from the wall, away from the floor, and e(d) of `ancf.free_edge`, which ends where this material
does, at the next wall, or else on the element's side. They are the functions of `ancf.layer` for walls inside elements.
On the groove's side nothing is beyond the floor. Where the element's side is nearer than h / sqrt(10) behind a wall, h
the thickness, nearly all of this material is the next element's: the functions go on there, as far as that element's
side. Where they would end as near nonetheless, there is no room: a rib that a plane of symmetry halves needs it on its
own half. Where they would end much farther than the thickness, what the element has beside the layer is too coarse for
it: the shoulder of the tire then slides too easily.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ancf.free_edge import DECAY, fading
from ancf.layer import LEAST, Through, through
from ancf.mesh import HAIR, Cell, Mesh, Special
from ancf.nurbs import curve_derivatives
from ancf.shape import Kink, ShapeValues, Wider, numbered
from ancf.subdomain import GROOVE, PROTRUSION, TOP, Band, Feature, Outlined

KINDS = ("r_w", "d_w", "l_w")
PLAIN = 2  # of these kinds are those of a wall without lip
NEAR = 0.02  # of an element's size: a wall this near to a grid line stands on it
ROOM = 1.0, 3.2  # times 1 / decay: between these a lip has room from its wall to where it ends
DIGITS = 11  # of an element's size, to which walls stand alike in equal elements
DEEP = 1e-9  # of the greatest depth: what is as deep is floor


class Lip(NamedTuple):
    """T of a lip, whose `decay` is by parameter, the way out of the floor (1 or -1), and where e ends: a parameter, or
    in a `Wall` the distance from the element's corner, as the wall's own place."""

    through: Through
    outward: int
    end: float


class Wall(NamedTuple):
    """Functions of a wall at the distance `at` from the element's corner on the axis `across`.

    side: 0 or 1, the side across the band on which L is 1. r_w, d_w and l_w belong to it. lip: None without one.
    inside: whether the wall stands in this element; into others only its lip reaches.
    """

    across: int
    at: float
    side: int
    lip: Lip | None = None
    inside: bool = True

    @property
    def kinds(self) -> tuple[str, ...]:
        """What its vectors are."""
        return (KINDS[:PLAIN] if self.inside else ()) + (KINDS[PLAIN:] if self.lip is not None else ())

    @property
    def in_z(self) -> tuple[Kink | int, ...]:
        """The Z of each: its number in `Plate.in_z`, or the kink."""
        return ((0, 1) if self.inside else ()) + ((self.lip.through.kink,) if self.lip is not None else ())


@dataclass(frozen=True)
class Walled(Wider):
    """A member of the family with wall functions after its own: those of r_w, d_w and l_w of each wall and side."""

    walls: tuple[Wall, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each nodal vector of the element is (i,)."""
        return self.base.kinds + tuple(kind for wall in self.walls for kind in wall.kinds)

    @property
    def kinks(self) -> tuple[Kink, ...]:
        """The T of its lips."""
        return numbered(wall.lip.through.kink for wall in self.walls if wall.lip is not None)

    @property
    def in_z(self) -> tuple[int, ...]:
        """As in `Plate`."""
        own = (factor for wall in self.walls for factor in wall.in_z)
        return (*self.base.in_z, *(self.number_of(Z) if isinstance(Z, Kink) else Z for Z in own))

    def lines(self, axis: int) -> list[float]:
        """Where they have a kink on an axis, from the element's corner; a lip may end beyond its sides."""
        own = [wall for wall in self.walls if wall.across == axis]
        return sorted({wall.at for wall in own if wall.inside} | {wall.lip.end for wall in own if wall.lip is not None})

    def evaluate(self, points: np.ndarray, size: tuple[float, float]) -> ShapeValues:
        """Values at points (q, 3), measured from the element's corner (0, 0), for sides `size` = (a, b)."""
        base, z = self.base.evaluate(points, size), points[:, 2]
        S, S_p = [base.S], [base.S_p]
        for wall in self.walls:
            if wall.inside:
                f, f_x, f_y = _in_plane(wall, points, size)
                S.append(np.stack([f, z * f], axis=1))
                straight, tilted = (f_x, f_y, np.zeros_like(f)), (z * f_x, z * f_y, f)
                S_p.append(np.stack([np.stack(straight, axis=1), np.stack(tilted, axis=1)], axis=1))
            if wall.lip is not None:
                f, f_x, f_y = _fading(wall, points, size)
                T, T_z = wall.lip.through.kink(z)
                S.append((f * T)[:, None])
                S_p.append(np.stack([f_x * T, f_y * T, f * T_z], axis=1)[:, None])
        return ShapeValues(np.concatenate(S, axis=1), np.concatenate(S_p, axis=1))


def _in_plane(wall: Wall, points: np.ndarray, size: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """h L and its derivatives by x and y, each (q,)."""
    y = points[:, wall.across]
    rest, before = size[wall.across] - wall.at, points[:, wall.across] < wall.at
    h, h_y = np.where(before, y / wall.at, (size[wall.across] - y) / rest), np.where(before, 1 / wall.at, -1 / rest)
    return _times(wall, h, h_y, points, size)


def _fading(wall: Wall, points: np.ndarray, size: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """e L and its derivatives by x and y, each (q,); zero over the floor and beyond the end."""
    through, outward, end = wall.lip
    d, room = outward * (points[:, wall.across] - wall.at), outward * (end - wall.at)
    e, e_d = fading(through.decay, np.clip(d, 0.0, room), room)
    there = (d > 0) & (d <= room * (1 + HAIR))
    return _times(wall, np.where(there, e, 0.0), np.where(there, outward * e_d, 0.0), points, size)


def _times(wall: Wall, h, h_y, points: np.ndarray, size: tuple[float, float]) -> tuple[np.ndarray, ...]:
    """h L of a function h across the band, and its derivatives by x and y, each (q,)."""
    s = points[:, 1 - wall.across] / size[1 - wall.across]
    L, L_x = (s, 1 / size[1 - wall.across]) if wall.side else (1 - s, -1 / size[1 - wall.across])
    along, across = h * L_x, h_y * L
    return (h * L, along, across) if wall.across == 1 else (h * L, across, along)


def with_walls(mesh: Mesh, bands: Sequence[Feature], thickness: float | None = None) -> Mesh:
    """The mesh with wall functions wherever the floor of a band begins or ends inside elements; lips with a thickness.

    Where a band ends along its own axis they end on the last grid line before. Outlines have none.
    """
    own: dict[int, list[tuple[Wall, tuple]]] = {}
    after: dict[tuple, tuple[int, tuple[str, ...]]] = {}
    for across in (0, 1):
        for row, at in _places(mesh, bands, across):
            columns, lip = _columns(mesh, bands, across, row, at), _lip(mesh, bands, across, row, at, thickness)
            for reached in _rows(mesh, across, row, lip):
                for e, side, line in _sides(mesh, across, reached, columns):
                    wall, key = _wall(mesh.cells[e], across, at, side, lip, reached == row), (across, row, at, line)
                    own.setdefault(e, []).append((wall, key))
                    after.setdefault(key, (_director(mesh, e, across, side), wall.kinds))
    if not own:
        return mesh
    keys = list(after)
    first, kinds = zip(*after.values(), strict=True)
    wider, numbers = mesh.extended(np.array(first), kinds, np.array([_parameters(mesh, *key) for key in keys]))
    number_of = dict(zip(keys, numbers, strict=True))
    special = {}
    for e, found in own.items():
        vectors = [wider.connectivity[e], *(number_of[key][-len(wall.kinds) :] for wall, key in found)]  # l_w is last
        special[e] = Special(Walled(mesh.shape, tuple(wall for wall, _ in found)), np.concatenate(vectors))
    return replace(wider, special=special)


def _wall(cell: Cell, across: int, at: float, side: int, lip: Lip | None, inside: bool) -> Wall:
    """A wall as the element of a cell knows it; equal elements round alike."""
    low, high = cell[across]
    digits = DIGITS - math.ceil(math.log10(high - low))
    own = lip and lip._replace(end=round(lip.end - low, digits))
    return Wall(across, round(at - low, digits), side, own, inside)


def _rows(mesh: Mesh, across: int, row: int, lip: Lip | None) -> list[int]:
    """The row of a wall, and after it the next one where its lip goes on there."""
    lines = (mesh.x_lines, mesh.y_lines)[across]
    if lip is None or lines[row] <= lip.end <= lines[row + 1]:
        return [row]
    return [row, row + lip.outward]


def floor_edges(band: Band) -> list[float]:
    """Where the floor begins and ends, on the axis across the band; where it is but a line, the band's own edges."""
    if band.is_curved:
        place, depth = curve_derivatives(band.section, band.section.breaks)[0].T
        floor = place[depth >= depth.max() * (1 - DEEP)]
        if np.ptp(floor) > 0:
            return [float(floor.min()), float(floor.max())]
    return [float(limit) for limit in band.limits(band.across)]


def wall_sides(mesh: Mesh, bands: Sequence[Feature]) -> list[Band]:
    """Bands of no height from each wall on, where outlines cut the plate: their rules take parts of an element that are
    as thick for one, and would take those on both sides of a wall."""
    if not any(isinstance(band, Outlined) for band in bands) or not _walled(mesh):
        return []
    own = [(1 - across, place) for across in (1, 0) for _, place in _places(mesh, bands, across)]
    return [Band(TOP, PROTRUSION, along, (place, math.inf), 0.0) for along, place in own]


def _walled(mesh: Mesh) -> bool:
    return any(isinstance(shape, Walled) for shape, _ in mesh.special.values())


def _crossed(mesh: Mesh, band: Feature, across: int) -> Iterator[tuple[int, float]]:
    """Row of elements and place of each wall of a band inside elements on the axis across it."""
    lines = (mesh.x_lines, mesh.y_lines)[across]
    for at in floor_edges(band) if isinstance(band, Band) and band.across == across else ():
        row = int(np.searchsorted(lines, at)) - 1
        if 0 <= row < len(lines) - 1 and np.abs(lines[row : row + 2] - at).min() > NEAR * np.diff(lines)[row]:
            yield row, at


def _places(mesh: Mesh, bands: Sequence[Feature], across: int) -> list[tuple[int, float]]:
    """Row and place of each wall on an axis; those of several bands that a hair of the element parts are one."""
    found: list[tuple[int, float]] = []
    for row, at in sorted(place for band in bands for place in _crossed(mesh, band, across)):
        if not found or not _is_at(mesh, across, (row, at), *found[-1]):
            found.append((row, at))
    return found


def _is_at(mesh: Mesh, across: int, place: tuple[int, float], row: int, at: float) -> bool:
    """Whether a wall's `place` is (row, at), but for a hair of the element."""
    low, high = (mesh.x_lines, mesh.y_lines)[across][row : row + 2]
    return place[0] == row and abs(place[1] - at) <= HAIR * (high - low)


def _ending_at(mesh: Mesh, bands: Sequence[Feature], across: int, row: int, at: float) -> list[Band]:
    """The bands that have a wall at a place."""
    return [band for band in bands if any(_is_at(mesh, across, own, row, at) for own in _crossed(mesh, band, across))]


def _lip(mesh: Mesh, bands, across: int, row: int, at: float, thickness: float | None) -> Lip | None:
    """The lip of a wall, its end by parameter; None without thickness, without room, and where bands overlap."""
    own = _ending_at(mesh, bands, across, row, at)
    if thickness is None or len(own) > 1:
        return None
    (band,) = own
    like = _like(bands, band, thickness)
    if _covered(like, at):
        return None
    outward = (1 if at > np.mean(floor_edges(band)) else -1) * (1 if band.sign == GROOVE else -1)
    lines, decay = (mesh.x_lines, mesh.y_lines)[across], DECAY / thickness * mesh.metres(across)
    side, ring = row + (outward > 0), mesh.closed and across == 0
    if abs(lines[side] - at) * decay < ROOM[0] and 0 < side < len(lines) - 1 and not ring:
        side += outward
    ends = (lines[side], *_walls_beyond(mesh, band, like, at, outward))
    end = outward * min(outward * place for place in ends)
    if not ROOM[0] <= abs(end - at) * decay <= ROOM[1]:
        return None
    return Lip(through(band, thickness)._replace(across=across, decay=decay), outward, float(end))


def _like(bands: Sequence[Feature], own: Band, thickness: float) -> list[Band]:
    """Other bands along the same axis, of the same face and sign; of grooves those that are as deep or deeper."""
    kind, floor = (own.across, own.face, own.sign), own.face * through(own, thickness).floor
    others = [band for band in bands if isinstance(band, Band) and band is not own]
    same = [band for band in others if (band.across, band.face, band.sign) == kind]
    return [band for band in same if band.face * through(band, thickness).floor <= floor + LEAST * thickness]


def _covered(like: Sequence[Band], at: float) -> bool:
    """Whether another band takes away what a wall would end, or adds to it on both sides."""
    return any(low < at < high for low, high in map(floor_edges, like))


def _walls_beyond(mesh: Mesh, own: Band, like: Sequence[Band], at: float, outward: int) -> Iterator[float]:
    """Where the material beyond a band's floor ends on the way out of its wall, if it does so along the whole mesh: at
    the next groove that is as deep; that of a protrusion at its other edge."""
    lines = (mesh.x_lines, mesh.y_lines)[1 - own.across]
    for band in like if own.sign == GROOVE else [own]:
        begins, ends = floor_edges(band)[::outward]
        place = begins if own.sign == GROOVE else ends
        if _spans(band, lines[0], lines[-1]) and outward * (place - at) > 0:
            yield place


def _columns(mesh: Mesh, bands: Sequence[Feature], across: int, row: int, at: float) -> np.ndarray:
    """Whether a wall runs the whole length of each element of its row (n,)."""
    lines = (mesh.x_lines, mesh.y_lines)[1 - across]
    whole = np.zeros(len(lines) - 1, dtype=bool)
    for band in _ending_at(mesh, bands, across, row, at):
        whole |= _spans(band, lines[:-1], lines[1:])
    return whole


def _spans(band: Band, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Whether a band has all of the sides from `low` to `high` on its own axis, but for a hair."""
    (first, last), hair = band.limits(band.along), HAIR * (high - low)
    return (first <= low + hair) & (high - hair <= last)


def _sides(mesh: Mesh, across: int, row: int, columns: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """Element, its side, and the grid line there, of each place of a row where all elements beside it have the wall."""
    element = {tuple(corner): e for e, corner in enumerate(mesh.corners.tolist())}
    count, closed = len(columns), mesh.closed and across == 1
    for column in np.flatnonzero(columns).tolist():
        for side in (0, 1):
            beside = column + 2 * side - 1
            beside = beside % count if closed else beside
            if not 0 <= beside < count or columns[beside]:
                place = (column, row) if across == 1 else (row, column)
                line = column + side
                yield element[place], side, line % count if closed else line


def _director(mesh: Mesh, e: int, across: int, side: int) -> int:
    """The director's nodal vector at the corner of an element on a side, where its row begins."""
    corner = (side, 0) if across == 1 else (0, side)
    shape = mesh.shape
    return int(mesh.connectivity[e, shape.starts.index(corner) + shape.node_kinds.index("r_z")])


def _parameters(mesh: Mesh, across: int, row: int, at: float, line: int) -> tuple[float, float]:
    other = float((mesh.x_lines, mesh.y_lines)[1 - across][line])
    return (other, at) if across == 1 else (at, other)
