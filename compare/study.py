"""A study: every unit (scene, variant, solver, level) that a budget pays for, solved once and kept.

Each unit runs in a fresh process with one thread, a few at a time, longest expected first. Its
Result lies in one file whose name is a hash of all that the numbers depend on: the physics of the
scene, the level, the source of the solver's package, the two files of this package that a solver
reads, and the versions of the libraries behind it. A second run therefore only reads files, an
edited solver is computed again by itself, and so is a unit that failed for want of memory or of gmsh.
Solvers are handed in by dotted name; none is imported here.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path

from compare import pool
from compare.files import sweep
from compare.result import OK, Result, ResultError, load
from compare.scene import BUDGETS, Level, Scene

AS_STATED = "as stated"  # the variant's name of the unchanged scene at the level of the sensitivity
LIBRARIES = {
    "ancf": ("numpy", "scipy", "numba"),
    "reference": ("numpy", "scipy", "scikit-fem", "gmsh", "meshio", "numba", "pymetis", "pypardiso", "mkl"),
}
LIBRARIES["calculix"] = (*LIBRARIES["reference"], "ccx")
SOURCES = {"calculix": ("reports.calculix_solver", "compare.external.calculix", "reference_fe")}
OF_THE_MACHINE = ("gmsh_missing", "gmsh_busy", "out_of_memory")  # statuses that say nothing of the unit
CONTRACT = ("scene.py", "scene_parts.py", "scene_contact.py", "scene_outline.py", "scene_rim.py", "result.py")


@dataclass(frozen=True)
class Unit:
    """One thing to solve. module: dotted name of the solver; key: hash of all that the result depends on."""

    scene: Scene
    variant: str | None
    solver: str
    module: str
    level: Level
    key: str

    @property
    def label(self) -> str:
        """Name for people, for example "cantilever, top face: ancf 8x8, 3x3x2 points"."""
        return label(self)


@dataclass(frozen=True)
class Entry:
    """What became of a unit.

    variant: name of the sensitivity variant (`scene` is then the changed scene), AS_STATED for the
    unchanged scene at that level, or None for a level of the ladder. result: None without one.
    status: "ok", the solver's own name of a failure, "crashed: ..." with the reason, or "too_large: ..." where it was
    not started; message: more about it. wall_seconds: least wall time of `repeats` runs in one process, without the
    start of the process. fresh: solved now, not read from an earlier run. mode: which of the result's
    frequencies, from 1, the entry stands for; None where it stands for the whole result.
    """

    scene: Scene
    variant: str | None
    solver: str
    level: Level
    result: Result | None
    status: str
    message: str
    wall_seconds: float | None
    repeats: int
    fresh: bool
    key: str
    mode: int | None = None

    @property
    def ok(self) -> bool:
        """Whether there is a result to read numbers from."""
        return self.status == OK


@dataclass(frozen=True)
class Progress:
    """State of a study for whoever shows it: total units, entries finished, running (label, fraction), s left."""

    total: int
    finished: tuple[Entry, ...]
    running: tuple[tuple[str, float], ...]
    seconds_left: float | None


def run(
    scenes: list[Scene],
    solvers: dict[str, str],
    budget: str,
    folder: Path,
    jobs: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
    reuse: bool = True,
) -> list[Entry]:
    """Entries of all levels and sensitivity variants of the scenes that the budget pays for, in ladder order.

    solvers: name in the scene ("ancf", "reference") -> dotted module with solve and estimate.
    folder: where results are kept, one <key>.npz each. jobs: processes at a time. report is called
    with the state whenever it changes. reuse = False solves everything again. An interrupt ends the
    workers and leaves every finished result in place. Raises SceneError where a variant is wrong.
    """
    return solve(plan(scenes, solvers, budget), folder, jobs, report, reuse)


def solve(
    units: Sequence[Unit],
    folder: Path,
    jobs: int = 2,
    report: Callable[[Progress], None] = lambda progress: None,
    reuse: bool = True,
    timed: bool = False,
    any_size: bool = False,
) -> list[Entry]:
    """Entries of the units, in their order; see `run`.

    timed: the units of the ladders, whose wall times a page compares, run alone after all others have ended; one
    that an earlier run solved beside another is solved again. any_size: also units that are expected to need far more
    memory than the machine has.
    """
    sweep(folder)
    alone = {unit.key for unit in units if timed and unit.variant is None}
    distinct = {unit.key: unit for unit in reversed(units)}  # a ladder's label before a variant's
    found = {key: _kept(unit, folder) for key, unit in distinct.items()} if reuse else {}
    entries = {key: entry for key, entry in found.items() if entry and not (key in alone and _shared(entry))}

    def tell(running: tuple[tuple[str, float], ...], left: float | None) -> None:
        report(Progress(len(distinct), tuple(entries.values()), running, left))

    tell((), None)
    pending = [unit for key, unit in distinct.items() if key not in entries]
    together, single = ([unit for unit in pending if (unit.key in alone) is lone] for lone in (False, True))
    for outcome in chain(
        pool.solve(together, folder, jobs, tell, any_size), pool.solve(single, folder, 1, tell, any_size)
    ):
        entries[outcome.unit.key] = _finished(outcome, folder)
    return [_as(unit, entries[unit.key]) for unit in units]


def plan(scenes: list[Scene], solvers: dict[str, str], budget: str) -> list[Unit]:
    """Units of the ladders and of the sensitivity variants that the budget pays for."""
    return [
        unit(scene, variant, solver, module, level)
        for stated in scenes
        for solver, module in solvers.items()
        for scene, variant, level in _questions(stated, solver, budget)
    ]


def unit(scene: Scene, variant: str | None, solver: str, module: str, level: Level) -> Unit:
    """A unit under the key of all that its result depends on."""
    return Unit(scene, variant, solver, module, level, key(scene, solver, level, fingerprint(solver, module)))


def _questions(scene: Scene, solver: str, budget: str) -> Iterator[tuple[Scene, str | None, Level]]:
    """(scene, variant, level) of one solver."""
    for level in scene.ladder(solver, budget):
        yield scene, None, level
    wanted = scene.sensitivity
    if wanted is None or BUDGETS.index(wanted.budget) > BUDGETS.index(budget):
        return
    level = getattr(wanted, solver)
    if level is not None:
        yield scene, AS_STATED, level
        for variant in wanted.variants:
            yield scene.override(variant.set), variant.name, level


def key(scene: Scene, solver: str, level: Level, fingerprint: str) -> str:
    """Hash of everything that a result depends on; 24 hexadecimal digits. fingerprint: of the solver."""
    stated = {
        "physics": scene.physics(),
        "level": level.model_dump(mode="json", exclude={"budget"}),
        "solver": solver,
        "fingerprint": fingerprint,
    }
    return hashlib.sha256(json.dumps(stated, sort_keys=True).encode()).hexdigest()[:24]


def fingerprint(solver: str, module: str) -> str:
    """Hash of the source of the solver's package, of the contract's files and of the libraries' versions."""
    return _fingerprint(SOURCES.get(solver, (module.partition(".")[0],)), LIBRARIES.get(solver, LIBRARIES["ancf"]))


def source_files(package: str) -> list[Path]:
    """Python files of a package or of a single module, without importing it."""
    spec = importlib.util.find_spec(package)
    if spec is None:
        return []
    folders = spec.submodule_search_locations
    return sorted(Path(folders[0]).rglob("*.py")) if folders else [Path(spec.origin)]


def _fingerprint(packages: tuple[str, ...], libraries: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    files = [path for package in packages for path in source_files(package)]
    for path in (*files, *(Path(__file__).parent / name for name in CONTRACT)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    for name in ("python", *libraries):
        digest.update(f"{name} {version(name)}\0".encode())
    return digest.hexdigest()


@cache
def version(library: str) -> str | None:
    """Installed version of a library ("python": of the interpreter), None where it is not installed."""
    if library == "python":
        return platform.python_version()
    if library == "ccx":
        from compare.external import calculix

        return calculix.version() if calculix.available() else None
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return None


def label(about: Unit | Entry) -> str:
    """Name of a unit or entry for people; with its element where the scene's ladders have several."""
    from compare.table import element, rule

    where = about.scene.name if about.variant is None else f"{about.scene.name}, {about.variant}"
    points, several = rule(about.level), len({element(level) for level in about.scene.ladder("ancf")}) > 1
    named = f" {element(about.level)}" if points and several else ""
    return f"{where}: {about.solver} {level_name(about.level)}{named}{f', {points} points' if points else ''}"


def level_name(level: Level) -> str:
    """Short name of a level: "4x4" for a grid of elements, "h=0.1" for a size in metres."""
    return "x".join(map(str, level.mesh)) if hasattr(level, "mesh") else f"h={level.size:g}"


def _shared(entry: Entry) -> bool:
    """Whether another unit may have run while this one was timed."""
    return bool(entry.result.facts.get("beside"))


def _kept(unit: Unit, folder: Path) -> Entry | None:
    """Entry of an earlier run, or None where there is none that can be read or the machine failed, not the solver."""
    try:
        entry = _entry(unit, folder, None, "", fresh=False)
    except ResultError:
        return None
    return None if entry.status in OF_THE_MACHINE else entry


def _finished(outcome: pool.Outcome, folder: Path) -> Entry:
    """Entry of a unit whose worker ended. Without a crash's name a result may still be worth nothing: it cannot
    be read back, or somebody edited the solver meanwhile, so that nobody knows which source it belongs to."""
    unit = outcome.unit
    try:
        if key(unit.scene, unit.solver, unit.level, fingerprint(unit.solver, unit.module)) != unit.key:
            (folder / f"{unit.key}.npz").unlink(missing_ok=True)
            return _entry(unit, folder, "crashed: the solver's source changed while it ran", "run it again")
        return _entry(unit, folder, outcome.status, outcome.message)
    except ResultError as error:
        return _entry(unit, folder, "crashed: no readable result", str(error))


def _entry(unit: Unit, folder: Path, crash: str | None, message: str, fresh: bool = True) -> Entry:
    """Entry of a unit whose worker ended; `crash` is None where it wrote a result."""
    about = (unit.scene, unit.variant, unit.solver, unit.level)
    if crash is not None:
        return Entry(*about, None, crash, message, None, 0, fresh, unit.key)
    result = load(folder / f"{unit.key}.npz")
    repeats = int(result.facts.get("repeats", 1))
    return Entry(*about, result, result.status, result.message, result.seconds, repeats, fresh, unit.key)


def _as(unit: Unit, entry: Entry) -> Entry:
    """The entry of an equal unit under this unit's scene, variant and level."""
    return Entry(
        **{**vars(entry), "scene": unit.scene, "variant": unit.variant, "solver": unit.solver, "level": unit.level}
    )
