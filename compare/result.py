"""Result: one solver's answer to a scene at one resolution, and how it is kept on disk.

A result is one .npz file: the arrays by name, and a JSON header that explains itself (schema
version, scene, solver, level, scalars). NumPy alone reads it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from compare.files import replacing

SCHEMA = 3  # 2 added frequencies, 3 contact and volume ratios
READABLE = (1, 2, 3)
OK = "ok"
MOST = 8  # shots of a path


class ResultError(ValueError):
    """A result file that cannot be read; the message names file and reason."""


@dataclass(frozen=True)
class Outline:
    """Triangles of the body's true (grooved) surface, for pictures only.

    points (n, 3) reference positions in m, displacement (n, 3) in m at the last output time, or modes
    (k, n, 3): shapes of vibration, each scaled to the largest displacement 1; displacement is then zero.
    triangles (m, 3) indices of points, edges (k, 2) indices of points: lines of the mesh to draw.
    path (s, n, 3): displacement in m at the outputs path_index (s,), a few on the way to the last one.
    stress (n,): von Mises stress in Pa at the last output, where the scene asks for it.
    """

    points: np.ndarray
    displacement: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray
    modes: np.ndarray | None = None
    path: np.ndarray | None = None
    path_index: np.ndarray | None = None
    stress: np.ndarray | None = None


@dataclass
class Shots:
    """States on the way, evenly spaced however many outputs there will be: at most MOST of them, and at least half."""

    index: list[int] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)
    stride: int = 1

    def take(self, output: int, state: np.ndarray) -> None:
        """Keep the state of an output, counted from 0, if it is its turn; the first one is rest and never kept."""
        if output == 0 or output % self.stride:
            return
        self.index.append(output)
        self.states.append(state.copy())
        if len(self.index) > MOST:
            self.stride *= 2
            self.index, self.states = self.index[1::2], self.states[1::2]


@dataclass(frozen=True)
class Contact:
    """What the obstacles did to the plate.

    force (t, o, 3): resultant on the plate (N) of each obstacle, in the scene's order, at each output time.
    area (t, o): of the undeformed face (m2) that is pressed; with law "points" the number of pressed points.
    points (n, 3): reference coordinates (x, y, z) of the contact points on the plate's true face.
    share (n,): area (m2) that each stands for; 1 with law "points".
    pressure (n,): normal traction (Pa; N with law "points") there at the last output time.
    """

    force: np.ndarray
    area: np.ndarray
    points: np.ndarray
    share: np.ndarray
    pressure: np.ndarray


@dataclass(frozen=True)
class Rim:
    """What the rim did at each output time.

    displacement (t, 3): its translation (m). force, moment (t, 3): N, and N m about the origin of space moved with the
    rim, with which its stated motion is kept, beside the loads on it: no force along directions in which it is free.
    """

    displacement: np.ndarray
    force: np.ndarray
    moment: np.ndarray


@dataclass(frozen=True)
class Result:
    """What a solver found. Lengths in m, times in s, energies in J.

    scene: physics of the scene as JSON values. solver: "ancf" or "reference". level: the resolution
    as JSON values. h: length of an element's edge (m) that convergence is measured against.
    times (t,); probes: names; probe_position (p, 3) reference position of each probe (of a patch
    its mean); displacement (t, p, 3). energies: kind -> (t,), for example "kinetic", "strain",
    "external" (work done by the loads); with obstacles also "contact" (stored by their springs) and
    "dissipated" (spent by their dampers and friction). contact: where the scene has obstacles. rim: where it has one.
    status: "ok", or the name of the failure; then the arrays end at the last time that was reached.
    facts: further scalars worth a look, for example volume.
    load_parameter (t,): where statics followed an arc length, the load parameter at each output; times are then
    the length of the path, in units of the linear response to a load parameter of 1.
    volume_ratio (t, k): det F at the probes that ask for it, in their order.
    frequencies (k,): natural frequencies in Hz, ascending, where the scene asks for modes: there are then
    no times, and facts["rigid_modes"] counts the rigid motions of frequency 0 that are not among them.
    """

    scene: dict[str, Any]
    solver: str
    version: str
    level: dict[str, Any]
    h: float
    unknowns: int
    times: np.ndarray
    probes: tuple[str, ...]
    probe_position: np.ndarray
    displacement: np.ndarray
    energies: dict[str, np.ndarray]
    status: str = OK
    message: str = ""
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    peak_mb: float | None = None
    steps: int = 0
    newton_iterations: int = 0
    facts: dict[str, float] = field(default_factory=dict)
    outline: Outline | None = None
    load_parameter: np.ndarray | None = None
    frequencies: np.ndarray | None = None
    volume_ratio: np.ndarray | None = None
    contact: Contact | None = None
    rim: Rim | None = None

    def position(self, probe: str) -> np.ndarray:
        """Path of a probe (t, 3) in m."""
        index = self.probes.index(probe)
        return self.probe_position[index] + self.displacement[:, index]

    def _repr_html_(self) -> str:
        """What a notebook shows: scene, solver, level, status and the answers, every word escaped."""
        pairs = {"scene": self.scene.get("name"), "solver": f"{self.solver} {self.version}", "status": self.status}
        pairs |= {"h": f"{self.h:.4g} m", "unknowns": self.unknowns, "wall time": f"{self.seconds:.3g} s"}
        if len(self.times):
            places = {name: self.position(name)[-1].tolist() for name in self.probes}
            pairs |= {f"{name} at {self.times[-1]:.4g}": _meters(place) for name, place in places.items()}
        if self.frequencies is not None:
            pairs["frequencies"] = ", ".join(f"{hertz:.5g}" for hertz in self.frequencies) + " Hz"
        cells = "".join(f"<tr><th>{escape(str(k))}</th><td>{escape(str(v))}</td></tr>" for k, v in pairs.items())
        return f"<table>{cells}</table>"


def _meters(place: list[float]) -> str:
    return f"({', '.join(f'{x:.5f}' for x in place)}) m"


ARRAYS = ("times", "probe_position", "displacement")
OPTIONAL = ("frequencies", "load_parameter", "volume_ratio")
PARTS = {
    "outline": (Outline, ("points", "displacement", "triangles", "edges", "modes", "path", "path_index", "stress")),
    "contact": (Contact, ("force", "area", "points", "share", "pressure")),
    "rim": (Rim, ("displacement", "force", "moment")),
}


def save(result: Result, path: Path) -> None:
    """Write a result to `path` (.npz) in one atomic step: a killed run leaves the old file or none."""
    elsewhere = (*ARRAYS, *OPTIONAL, *PARTS, "energies")
    header = {key: value for key, value in vars(result).items() if key not in elsewhere}
    header = {"schema": SCHEMA, **header}
    arrays = {name: getattr(result, name) for name in (*ARRAYS, *OPTIONAL)}
    arrays |= {f"energy.{kind}": values for kind, values in result.energies.items()}
    for part, (_, names) in PARTS.items():
        if (own := getattr(result, part)) is not None:
            arrays |= {f"{part}.{name}": getattr(own, name) for name in names}
    stated = {name: values for name, values in arrays.items() if values is not None}
    with replacing(path) as file:
        np.savez_compressed(file, header=np.array(json.dumps(header)), **stated)


def load(path: Path) -> Result:
    """Read a result. Raises ResultError where the file is damaged or of a newer schema."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays.pop("header")))
    except Exception as error:
        raise ResultError(f"{path}: not a result file: {error}") from error
    schema = header.pop("schema", None) if isinstance(header, dict) else None
    if schema not in READABLE:
        raise ResultError(f"{path}: result schema {schema}, this version reads {' and '.join(map(str, READABLE))}")
    try:
        return _read(header, arrays)
    except (KeyError, TypeError) as error:
        raise ResultError(f"{path}: not a result of schema {schema}: {type(error).__name__}: {error}") from error


def _read(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> Result:
    """The result of a file's header and arrays; arrays that this version does not know are left alone."""
    header["probes"] = tuple(header["probes"])
    energies = {name.removeprefix("energy."): arrays[name] for name in arrays if name.startswith("energy.")}
    found = {name: arrays[name] for name in ARRAYS} | {name: arrays.get(name) for name in OPTIONAL}
    parts = {part: _part(arrays, part) for part in PARTS}
    return Result(**header, **found, **parts, energies=energies)


def _part(arrays: dict[str, np.ndarray], part: str) -> Outline | Contact | Rim | None:
    """A part of the result, None where the file has none."""
    kind, names = PARTS[part]
    own = {name: arrays[f"{part}.{name}"] for name in names if f"{part}.{name}" in arrays}
    return kind(**own) if own else None
