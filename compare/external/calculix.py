"""CalculiX: a solid of quadratic tetrahedra in implicit dynamics, written as a deck, run by `ccx`, read back.

*ELASTIC with NLGEOM is the St. Venant-Kirchhoff law; *DYNAMIC, DIRECT, ALPHA=0 is the trapezoidal rule with
fixed steps; *CLOAD forces keep their direction. C3D10 integrates at four points. Iterations end at CalculiX's
own default, a residual of 0.5 % of the mean force. Numbers in .dat files have seven digits. (CalculiX CrunchiX
User's Manual 2.20; Debian package calculix-ccx.)
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.pool import THREADS

PROGRAM = "ccx"
HEADER = "displacements (vx,vy,vz) for set PRINTED and time"
PER_LINE = 12  # numbers on a line of a node set; CalculiX reads 16 at most


class CalculixError(RuntimeError):
    """CalculiX is not installed, stopped, or wrote no answer; the message says which and quotes it."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A clamped solid under dead nodal forces. Indices count from zero.

    nodes (n, 3) in m. tetrahedra (e, 10): corners, then the middles of the edges 01, 12, 20, 03, 13, 23.
    fixed (k,): nodes held in all directions. force (n, 3) in N, times the piecewise linear `history` of
    (time, factor). density in kg/m3, youngs_modulus in Pa. step and until in s. printed (p,): nodes whose
    displacements are wanted after every step.
    """

    nodes: np.ndarray
    tetrahedra: np.ndarray
    fixed: np.ndarray
    force: np.ndarray
    history: Sequence[tuple[float, float]]
    density: float
    youngs_modulus: float
    poissons_ratio: float
    step: float
    until: float
    printed: np.ndarray


@dataclass(frozen=True, eq=False)
class Answer:
    """times (t,) in s, displacement (t, p, 3) in m of the printed nodes, and what the run cost."""

    times: np.ndarray
    displacement: np.ndarray
    wall_seconds: float
    cpu_seconds: float


def available() -> bool:
    """Whether `ccx` is on the path."""
    return shutil.which(PROGRAM) is not None


def version() -> str:
    """Version as `ccx` tells it. Raises CalculixError where it is not installed."""
    if not available():
        raise CalculixError(f"{PROGRAM} is not installed (Debian package calculix-ccx)")
    said = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True).stdout
    return said.strip().removeprefix("This is Version").strip()


def solve(problem: Problem) -> Answer:
    """Run CalculiX on one thread in a folder of its own. Raises CalculixError."""
    if not available():
        raise CalculixError(f"{PROGRAM} is not installed (Debian package calculix-ccx)")
    with tempfile.TemporaryDirectory(prefix="calculix") as folder:
        Path(folder, "job.inp").write_text(deck(problem), encoding="ascii")
        said, code, wall, usage = _run(Path(folder))
        written = Path(folder, "job.dat")
        text = written.read_text(encoding="ascii") if written.exists() else ""
    errors = [line.strip() for line in said.splitlines() if "*ERROR" in line]
    if code or errors:
        tail = "; ".join(errors) or " ".join(said.split()[-40:])
        raise CalculixError(f"{PROGRAM} stopped with exit status {code}: {tail}")
    times, displacement = read(text, problem.printed)
    if abs(times[-1] - problem.until) > 1e-5 * problem.until:
        raise CalculixError(f"{PROGRAM} ended at t = {times[-1]:g} s, wanted {problem.until:g} s")
    return Answer(times, displacement, wall, usage.ru_utime + usage.ru_stime)


def _run(folder: Path):
    """(output, exit code, wall seconds, resource usage) of `ccx job` in the folder."""
    limits = dict.fromkeys((*THREADS, "CCX_NPROC_STIFFNESS", "CCX_NPROC_EQUATION_SOLVER"), "1")
    begin = time.perf_counter()
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen(
            [PROGRAM, "-i", "job"], cwd=folder, stdout=said, stderr=subprocess.STDOUT, env={**os.environ, **limits}
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        return said.read(), process.returncode, time.perf_counter() - begin, usage


def deck(problem: Problem) -> str:
    """The input deck of a problem. Raises ValueError where its arrays do not fit together."""
    _check(problem)
    return "\n".join(_lines(problem)) + "\n"


def _check(problem: Problem) -> None:
    count = len(problem.nodes)
    if problem.nodes.shape != (count, 3) or problem.force.shape != (count, 3):
        raise ValueError(f"nodes {problem.nodes.shape} and force {problem.force.shape} must both be (n, 3)")
    if problem.tetrahedra.ndim != 2 or problem.tetrahedra.shape[1] != 10:
        raise ValueError(f"tetrahedra must be (e, 10), got {problem.tetrahedra.shape}")
    for name in ("tetrahedra", "fixed", "printed"):
        index = np.asarray(getattr(problem, name))
        if index.size == 0 or index.min() < 0 or index.max() >= count:
            raise ValueError(f"{name} must name nodes 0 to {count - 1} and at least one")
    if not 0 < problem.step <= problem.until:
        raise ValueError(f"step {problem.step} must be positive and not above until = {problem.until}")


def _lines(problem: Problem) -> Iterator[str]:
    """Lines of the deck; a number has 20 characters at most."""
    yield "*NODE, NSET=EVERY"
    for number, (x, y, z) in enumerate(problem.nodes.tolist(), 1):
        yield f"{number}, {x:.12e}, {y:.12e}, {z:.12e}"
    yield "*ELEMENT, TYPE=C3D10, ELSET=SOLID"
    for number, nodes in enumerate((problem.tetrahedra + 1).tolist(), 1):
        yield ", ".join(map(str, [number, *nodes]))
    for name in ("fixed", "printed"):
        yield f"*NSET, NSET={name.upper()}"
        yield from _listed(np.unique(getattr(problem, name)) + 1)
    yield from ("*MATERIAL, NAME=SVK", "*ELASTIC", f"{problem.youngs_modulus:.12e}, {problem.poissons_ratio:.12e}")
    yield from ("*DENSITY", f"{problem.density:.12e}", "*SOLID SECTION, ELSET=SOLID, MATERIAL=SVK")
    yield from ("*BOUNDARY", "FIXED, 1, 3")
    yield "*AMPLITUDE, NAME=HISTORY"
    for time_, factor in problem.history:
        yield f"{time_:.12e}, {factor:.12e}"
    yield f"*STEP, NLGEOM, INC={2 * round(problem.until / problem.step) + 10}"
    yield from ("*DYNAMIC, DIRECT, ALPHA=0.", f"{problem.step:.12e}, {problem.until:.12e}")
    yield "*CLOAD, AMPLITUDE=HISTORY"
    for node, axis in np.argwhere(problem.force):
        yield f"{node + 1}, {axis + 1}, {problem.force[node, axis]:.12e}"
    yield from ("*NODE PRINT, NSET=PRINTED", "U", "*END STEP")


def _listed(numbers: np.ndarray) -> Iterator[str]:
    for start in range(0, len(numbers), PER_LINE):
        yield ", ".join(map(str, numbers[start : start + PER_LINE].tolist())) + ","


def read(text: str, printed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """times (t,) and displacements (t, p, 3) of a .dat file, in the order of `printed`. Raises CalculixError."""
    times, blocks = [], []
    for line in text.splitlines():
        if HEADER in line:
            times.append(float(line.rpartition("time")[2]))
            blocks.append({})
        elif blocks and (words := line.split()):
            blocks[-1][int(words[0]) - 1] = [float(word) for word in words[1:4]]
    if not blocks:
        raise CalculixError("the .dat file holds no displacements of the printed nodes")
    try:
        displacement = np.array([[block[int(node)] for node in printed] for block in blocks])
    except KeyError as error:
        raise CalculixError(f"node {error} is not in the .dat file") from error
    return np.array(times), displacement
