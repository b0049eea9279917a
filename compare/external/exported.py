"""Answers of any other code, read from the files it exports: a table of values, or a field of displacements.

A table is comma- or semicolon-separated text with a header line: h (m), value (the scene's answer: a height in m, or
a frequency in Hz), and if wanted seconds, unknowns and mode. A field is any format that meshio reads (VTU, Abaqus,
Ansys, VTK, ...; some, like MED and XDMF, want h5py) with the undeformed nodes and a displacement (n, 3) at them, in m.
"""

from __future__ import annotations

import contextlib
import csv
import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.result import Outline, Result
from compare.scene import Interval, Region, Scene
from compare.scene_geometry import all_bands, limits, material_range
from compare.study import Entry

TABLES = (".csv", ".txt", ".tsv", ".dat")
NAMES = ("displacement", "displacements", "disp", "u", "deplacement")  # of fields, lower case
FACES = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2, 3),),
}
SAMPLES = 5  # boxes through the material over a patch whose mean is read, and along it from one wall to the next
STEPS = (np.arange(SAMPLES) + 0.5) / SAMPLES
OUTSIDE = 1e-6  # of the body's size: how far outside the nodes a probe may lie


class ExportError(ValueError):
    """A file that cannot join a table; the message names file, place and reason."""


@dataclass(frozen=True)
class ExportedLevel:
    """Resolution of an answer that was read: element length (m), the file it came from, and nothing about steps."""

    size: float
    element: str
    fit: None = None
    enrich: None = None
    walls: None = None
    lips: None = None
    volumetric: None = None
    integrator: None = None
    time_step: None = None
    budget: str = "quick"


def entries(scene: Scene, path: Path, name: str, h: float | None = None, array: str | None = None) -> list[Entry]:
    """The levels that a file holds for a scene, coarse to fine, under the solver's name.

    h: element length (m) of a field, its mean edge where it is not given; array: name of the displacement. Raises
    ExportError.
    """
    if not path.is_file():
        raise ExportError(f"{path}: no such file")
    if reason := _misnamed(name):
        raise ExportError(f"--name {name!r}: {reason}")
    if path.suffix.lower() in TABLES:
        found = _tabled(scene, path, name)
    else:
        found = [_from_field(scene, path, name, h, array)]
    return [_entry(scene, result, path) for result in sorted(found, key=lambda result: -result.h)]


def _misnamed(name: str) -> str | None:
    """Why a third solver cannot have this name, None where it can: results and bodies are known by it."""
    if name.strip().lower() in ("ancf", "reference"):
        return "this is one of the two solvers that the file is compared with"
    if not (name.strip() and name.isprintable() and re.fullmatch(r"[^./\\][^/\\]{0,99}", name)):
        return "use 1 to 100 printable characters without / and \\, no . first"
    return None


def _entry(scene: Scene, result: Result, path: Path) -> Entry:
    level = ExportedLevel(result.h, f"as in {path.name}")
    about = (scene, None, result.solver, level, result, result.status, result.message, result.seconds or None)
    return Entry(*about, repeats=1, fresh=True, key=f"{result.solver}-{path.name}-{result.h:.9g}")


def _tabled(scene: Scene, path: Path, name: str) -> list[Result]:
    """A result per h of a table; several modes of one h are one result."""
    groups: dict[float, list[dict[str, Any]]] = {}
    vibrates = scene.analysis.kind == "modes"
    for place, row in _rows(path):
        if vibrates and "mode" not in row:
            raise ExportError(f"{place}: the scene asks for modes; a column mode says which (1 is the lowest)")
        members = groups.setdefault(row["h"], [])
        if any(other.get("mode") == row.get("mode") for other in members):
            raise ExportError(f"{place}: h = {row['h']:g} occurs twice")
        members.append(row)
    if vibrates:
        for h, members in groups.items():
            _every_mode(members, scene.analysis.count, f"{path}: h = {h:g}")
    return [_told(scene, name, h, members) for h, members in groups.items()]


def _every_mode(members: list[dict[str, Any]], count: int, where: str) -> None:
    members.sort(key=lambda row: row["mode"])
    if [row["mode"] for row in members] != list(range(1, count + 1)):
        raise ExportError(f"{where}: has modes {[row['mode'] for row in members]}, the scene asks for 1 to {count}")


def _rows(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """(place, values) of each line of a table."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ExportError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise ExportError(f"{path}: needs a header line (h,value) and a line of numbers below it")
    mark = next((mark for mark in ";\t," if mark in lines[0][1]), ",")
    header = [word.strip().lower() for word in next(csv.reader([lines[0][1]], delimiter=mark))]
    if missing := {"h", "value"} - set(header):
        raise ExportError(f"{path}: line {lines[0][0]}: no column {' and '.join(sorted(missing))} in {header}")
    for i, line in lines[1:]:
        cells = next(csv.reader([line], delimiter=mark))
        if len(cells) != len(header):
            raise ExportError(f"{path}: line {i}: {len(cells)} cells under {len(header)} headers")
        yield (
            f"{path}: line {i}",
            {name: _number(path, i, name, cell) for name, cell in zip(header, cells, strict=True) if name in CHECKS},
        )


CHECKS = {
    "h": (lambda value: value > 0, "an element length in m, above 0"),
    "value": (lambda value: True, "a number"),
    "seconds": (lambda value: value >= 0, "seconds, not below 0"),
    "unknowns": (lambda value: value >= 0 and value == int(value), "a whole number, not below 0"),
    "mode": (lambda value: value >= 1 and value == int(value), "a whole number from 1"),
}


def _number(path: Path, line: int, name: str, cell: str) -> float:
    good, wanted = CHECKS[name]
    try:
        value = float(cell)
    except ValueError as error:
        raise ExportError(f"{path}: line {line}: {name} = {cell.strip()!r}: wanted {wanted}") from error
    if not math.isfinite(value) or not good(value):
        raise ExportError(f"{path}: line {line}: {name} = {cell.strip()}: wanted {wanted}")
    return value


def _told(scene: Scene, name: str, h: float, rows: list[dict[str, Any]]) -> Result:
    """A result that holds values and nothing else."""
    if scene.analysis.kind == "modes":
        more = _vibrating([row["value"] for row in rows])
    else:
        more = _moved(scene, np.zeros((1, 3)), np.array([[0.0, 0.0, rows[0]["value"]]]))
    return _result(scene, name, h, int(rows[0].get("unknowns", 0)), rows[0].get("seconds", 0.0), more)


def _vibrating(frequencies: list[float]) -> dict[str, Any]:
    empty = {"times": np.empty(0), "probe_position": np.empty((0, 3)), "displacement": np.empty((0, 0, 3))}
    return {**empty, "probes": (), "frequencies": np.array(frequencies)}


def _moved(scene: Scene, position: np.ndarray, displacement: np.ndarray) -> dict[str, Any]:
    """position, displacement (1, 3) of the answer probe at the last output time."""
    found = {"times": np.array([float(scene.analysis.until)]), "probes": (scene.probes[0].name,)}
    return {**found, "probe_position": position, "displacement": displacement[None]}


def _result(scene: Scene, name: str, h: float, unknowns: int, seconds: float, more: dict[str, Any]) -> Result:
    about = {"scene": scene.physics(), "solver": name, "version": "as exported", "level": {"size": h}}
    return Result(**about, h=h, unknowns=unknowns, energies={}, seconds=seconds, **more)


def _from_field(scene: Scene, path: Path, name: str, h: float | None, array: str | None) -> Result:
    """The answer read off a field of displacements at the last output time."""
    if scene.analysis.kind == "modes":
        raise ExportError(f"{path}: the scene asks for frequencies, which a field of displacements does not hold")
    if scene.surface.kind != "rectangle":
        raise ExportError(f"{path}: fields are read for flat plates; give the values of {scene.name} as a table")
    mesh = _read(path)
    moved = _displacement(mesh, path, array)
    points = np.asarray(mesh.points, float)
    probe = scene.probes[0]
    at, share = (np.array([probe.at]), np.ones(1)) if hasattr(probe, "at") else _samples(scene, probe.region)
    value = _interpolated(points, moved, at, path, probe.name)
    cells = _bodies([(block.type, block.data) for block in mesh.cells])
    h = h or _edge(points, cells, path)
    more = _moved(scene, (share @ at)[None], (share @ value)[None])
    more["outline"] = _outline(points, moved, cells)
    return _result(scene, name, h, 3 * len(points), 0.0, more)


def _read(path: Path) -> Any:
    """The file as meshio reads it; meshio prints its reasons and may end the program, which becomes an error here."""
    import meshio

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        words = " ".join(said.getvalue().split()) or str(error) or type(error).__name__
        raise ExportError(f"{path}: cannot be read as a mesh: {words}") from error


def _displacement(mesh: Any, path: Path, array: str | None) -> np.ndarray:
    """The displacement (n, 3) of a mesh's nodes, in m."""
    held = {name: np.asarray(values) for name, values in mesh.point_data.items()}
    chosen = array or next((name for name in held if name.lower() in NAMES), None)
    if chosen not in held:
        wanted = f"no field {array!r}" if array else "no field named like a displacement (--field NAME)"
        raise ExportError(f"{path}: {wanted} among the point data {sorted(held) or 'which is empty'}")
    values = held[chosen]
    if values.shape != (len(mesh.points), 3):
        raise ExportError(f"{path}: field {chosen!r} has shape {values.shape}, wanted {(len(mesh.points), 3)}")
    if np.asarray(mesh.points).shape[1] != 3 or not np.isfinite(values).all() or not np.isfinite(mesh.points).all():
        raise ExportError(f"{path}: nodes or field {chosen!r} hold no finite numbers in three dimensions")
    return values.astype(float)


def _samples(scene: Scene, region: Region) -> tuple[np.ndarray, np.ndarray]:
    """Middles (k, 3) of boxes that fill the material over a region, and their shares (k,) of its volume.

    A mean over them is the patch's to order h² of the boxes, whose edges are at the walls of straight bands.
    """
    (x, x_width), (y, y_width) = (_middles(scene, interval, axis) for axis, interval in enumerate(region))
    low, high = np.moveaxis([[material_range(scene, a, b) for a in x] for b in y], -1, 0)
    z = low[..., None] + np.multiply.outer(high - low, STEPS)
    volume = np.repeat((high - low) * np.outer(y_width, x_width), SAMPLES)
    return np.stack(np.broadcast_arrays(x[:, None], y[:, None, None], z), axis=-1).reshape(-1, 3), volume / volume.sum()


def _middles(scene: Scene, interval: Interval, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles (n,) and widths (n,) of even steps between the walls that straight bands have in an interval."""
    low, high = np.clip(interval, *scene.surface.span[axis])
    bands = [band for _, band in all_bands(scene) if not hasattr(band, "outline")]
    walls = np.array([wall for band in bands for wall in limits(scene, band, axis)])
    breaks = np.unique([low, high, *walls[(walls > low) & (walls < high)]])
    width = np.diff(breaks)
    return (breaks[:-1, None] + np.outer(width, STEPS)).ravel(), np.repeat(width / SAMPLES, SAMPLES)


def _interpolated(points: np.ndarray, moved: np.ndarray, at: np.ndarray, path: Path, name: str) -> np.ndarray:
    """Displacement (k, 3) at points: that of a node which lies there, else linear between the nodes around."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError, cKDTree

    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    distance, nearest = cKDTree(points).query(at)
    if (distance <= OUTSIDE * size).all():
        return moved[nearest]
    try:
        flat = np.ptp(points, axis=0)[2] <= OUTSIDE * size
        axes = slice(0, 2) if flat else slice(0, 3)
        values = LinearNDInterpolator(points[:, axes], moved)(at[:, axes])
    except QhullError as error:
        raise ExportError(f"{path}: the nodes span no body around probe {name}") from error
    outside = ~np.isfinite(values).all(axis=1)
    if outside.any():
        low, high = (np.round(edge(points, axis=0), 6).tolist() for edge in (np.min, np.max))
        place = np.round(at[outside][0], 6).tolist()
        raise ExportError(f"{path}: probe {name} at {place} m lies outside the nodes, which fill {low} to {high} m")
    return values


def _corners(kind: str) -> str | None:
    """Name of the linear cell under a cell of any order; None for lines, points and what else is no body."""
    base = kind.rstrip("0123456789")
    return base if base in FACES else None


def _bodies(cells: list[tuple[str, np.ndarray]]) -> list[tuple[str, np.ndarray]]:
    """The solids of a mesh, or its shells where it has no solid: a file may list the faces of solids too."""
    solid = [(kind, nodes) for kind, nodes in cells if _corners(kind) not in (None, "triangle", "quad")]
    return solid or [(kind, nodes) for kind, nodes in cells if _corners(kind)]


def _edge(points: np.ndarray, cells: list[tuple[str, np.ndarray]], path: Path) -> float:
    """Mean length (m) of the edges of all faces."""
    lengths = []
    for kind, nodes in cells:
        for face in FACES.get(_corners(kind) or "", ()):
            corner = points[nodes[:, list(face)]]
            lengths.append(np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).ravel())
    if not lengths or not np.concatenate(lengths).size:
        raise ExportError(f"{path}: has no cells to measure h from; give it (--h METRES)")
    return float(np.concatenate(lengths).mean())


def _outline(points: np.ndarray, moved: np.ndarray, cells: list[tuple[str, np.ndarray]]) -> Outline | None:
    """Faces that belong to one cell alone, as triangles over their corners; None without cells."""
    faces: list[np.ndarray] = []
    for kind, nodes in cells:
        for face in FACES.get(_corners(kind) or "", ()):
            faces.append(np.pad(nodes[:, list(face)], ((0, 0), (0, 4 - len(face))), mode="edge"))
    if not faces:
        return None
    every = np.concatenate(faces)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    outer = every[first[count == 1]]
    triangles = np.concatenate([outer[:, [0, 1, 2]], outer[outer[:, 2] != outer[:, 3]][:, [0, 2, 3]]])
    edges = np.concatenate([outer[:, [0, 1]], outer[:, [1, 2]], outer[:, [2, 3]], outer[:, [3, 0]]])
    used, place = np.unique(triangles, return_inverse=True)
    renamed = np.zeros(len(points), int)
    renamed[used] = np.arange(len(used))
    return Outline(points[used], moved[used], place.reshape(-1, 3), renamed[edges[edges[:, 0] != edges[:, 1]]])
