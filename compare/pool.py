"""Worker processes: units in, one Outcome each, a few at a time, longest expected first."""

from __future__ import annotations

import json
import os
import pickle
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from compare.worker import Task

if TYPE_CHECKING:
    from compare.study import Unit

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
SHARE = 0.8  # of the machine's memory that workers may be expected to use together
MARGIN = 1.5  # times the machine's memory: a unit that is expected to need more is refused, as estimates are rough
TAIL = 2000  # characters of a crashed worker's standard error that are kept

Tell = Callable[[tuple[tuple[str, float], ...], float | None], None]


@dataclass(frozen=True)
class Outcome:
    """How a unit's worker ended: status None where a result was written, else "crashed: reason", or "too_large: needs"
    where none was started."""

    unit: Unit
    status: str | None
    message: str = ""


@dataclass
class Job:
    """A running worker. said: last message of each kind it sent; fraction: part of the work that is done."""

    about: Any
    process: subprocess.Popen
    errors: IO[bytes]
    began: float = field(default_factory=time.monotonic)
    unread: bytes = b""
    said: dict[str, Any] = field(default_factory=dict)

    @property
    def fraction(self) -> float:
        """Part of the work that the worker reported as done, 0 to 1."""
        return min(max(self.said.get("fraction", 0.0), 0.0), 1.0)


def solve(units: list[Unit], folder: Path, jobs: int, tell: Tell, any_size: bool = False) -> Iterator[Outcome]:
    """Outcomes of the units as they end; results go to folder/<key>.npz. tell(running, seconds left) on changes.

    any_size: units that the machine's memory is expected not to hold are started too, not refused. The worker of a unit
    that is alone finds out itself, which saves another one's start.
    """
    if not units:
        return
    folder.mkdir(parents=True, exist_ok=True)
    estimates = estimate(units, jobs) if len(units) > 1 else {}
    most = None if len(units) > 1 or any_size else largest_mb()
    costs = {unit.key: _cost(unit, estimates.get(unit.key)) for unit in units}
    memory = {unit.key: estimates.get(unit.key, {}).get("memory_mb") or 0.0 for unit in units}
    refused = {} if any_size else {unit.key: unit for unit in units if too_large(memory[unit.key])}
    waiting = sorted((unit for unit in units if unit.key not in refused), key=lambda unit: -costs[unit.key])
    rates: dict[str, list[float]] = {}

    def next_task(running: list[Job]) -> tuple[Unit, Task] | None:
        used = sum(memory[job.about.key] for job in running)
        for unit in waiting:
            if not running or used + memory[unit.key] <= SHARE * physical_mb():
                waiting.remove(unit)
                path = folder / f"{unit.key}.npz"
                return unit, Task("solve", unit.module, ((unit.scene, unit.level),), path, jobs > 1, most)
        return None

    def show(running: list[Job]) -> None:
        shown = tuple((job.about.label, job.fraction) for job in running)
        tell(shown, seconds_left(running, waiting, costs, rates, jobs))

    for unit in refused.values():
        yield _refused(unit, memory[unit.key])
        show([])
    for job in work(next_task, jobs, show):
        rates.setdefault(job.about.solver, []).append((time.monotonic() - job.began) / costs[job.about.key])
        needed = job.said.get("too_large")
        yield Outcome(job.about, *ending(job)) if needed is None else _refused(job.about, needed)


def estimate(units: list[Unit], jobs: int) -> dict[str, dict[str, Any]]:
    """The solvers' own estimates by key, one worker per solver; empty where a solver cannot tell."""
    modules = {unit.module: [other for other in units if other.module == unit.module] for unit in units}
    waiting = list(modules.items())

    def next_task(running: list[Job]) -> tuple[list[Unit], Task] | None:
        if not waiting:
            return None
        module, asked = waiting.pop()
        return asked, Task("estimate", module, tuple((unit.scene, unit.level) for unit in asked))

    found = {}
    for job in work(next_task, jobs, lambda running: None):
        found |= {unit.key: stated for unit, stated in zip(job.about, job.said.get("estimates", ()), strict=False)}
    return found


def work(next_task: Callable[[list[Job]], Any], jobs: int, show: Callable[[list[Job]], None]) -> Iterator[Job]:
    """Run the tasks that next_task(running) hands out, at most `jobs` at a time; yields each job as it ends.

    Ends every running worker when it is left early, by an exception or an interrupt.
    """
    running: list[Job] = []
    with selectors.DefaultSelector() as selector:
        try:
            while True:
                while len(running) < jobs and (given := next_task(running)):
                    running.append(start(*given))
                    selector.register(running[-1].process.stdout, selectors.EVENT_READ, running[-1])
                if not running:
                    return
                for ready, _ in selector.select(timeout=1.0):
                    job = ready.data
                    if not _read(job):
                        selector.unregister(job.process.stdout)
                        job.process.wait()
                        running.remove(job)
                        yield job
                show(running)
        finally:
            for job in running:
                with suppress(ProcessLookupError):
                    os.killpg(job.process.pid, signal.SIGKILL)  # with the programs that it started
                job.process.wait()


def start(about: Any, task: Task) -> Job:
    """Start a worker on a task: one thread, its own session, so that an interrupt reaches only the parent."""
    limits = dict.fromkeys(THREADS, "1")
    paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
    errors = tempfile.TemporaryFile()
    process = subprocess.Popen(
        [sys.executable, "-m", "compare.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        env={**os.environ, **limits, "PYTHONPATH": paths},
        start_new_session=True,
    )
    try:
        process.stdin.write(pickle.dumps(task))
        process.stdin.close()
    except BrokenPipeError:
        pass  # it is dead already; its exit status tells
    return Job(about, process, errors)


def ending(job: Job) -> tuple[str | None, str]:
    """(status, message) of an ended worker: (None, "") where it did what it was asked."""
    job.errors.seek(0)
    tail = job.errors.read().decode(errors="replace").strip()[-TAIL:]
    code = job.process.returncode
    if "error" in job.said:
        return f"crashed: {job.said['error']}", job.said["trace"]
    if code < 0:
        return f"crashed: killed by {signal.Signals(-code).name}", tail
    if code or "done" not in job.said:
        return f"crashed: exit status {code}", tail
    return None, ""


def seconds_left(
    running: list[Job], waiting: list[Unit], costs: dict[str, float], rates: dict[str, list[float]], jobs: int
) -> float | None:
    """Expected seconds to the end; None until every solver at work has shown its pace."""
    now, pace = time.monotonic(), {solver: sum(seen) / len(seen) for solver, seen in rates.items()}
    for job in running:
        if job.fraction > 0:
            pace.setdefault(job.about.solver, (now - job.began) / job.fraction / costs[job.about.key])
    rest = [(unit, 1.0) for unit in waiting] + [(job.about, 1 - job.fraction) for job in running]
    if any(unit.solver not in pace for unit, _ in rest):
        return None
    left = sum(part * pace[unit.solver] * costs[unit.key] for unit, part in rest)
    return left / max(1, min(jobs, len(running)))


def _cost(unit: Unit, stated: dict[str, Any] | None) -> float:
    """Relative expected effort: steps times a power of the unknowns between assembly (1) and factorisation (1.5)."""
    steps = 1 if unit.level.time_step is None else unit.scene.analysis.until / unit.level.time_step
    return steps * max((stated or {}).get("unknowns") or 1, 1) ** 1.3


def too_large(memory_mb: float) -> bool:
    """Whether a unit that is expected to need that much memory is refused on this machine."""
    return memory_mb > largest_mb()


def largest_mb() -> float:
    """What a unit may be expected to need, in MiB."""
    return MARGIN * physical_mb()


def _refused(unit: Unit, memory_mb: float) -> Outcome:
    """The outcome of a unit that is not started."""
    status = f"too_large: needs about {memory_mb / 1024:,.0f} GiB of memory"
    has = f"this machine has {physical_mb() / 1024:,.0f} GiB"
    return Outcome(unit, status, f"{has}; a coarser level needs less, and --any-size starts it all the same")


def physical_mb() -> float:
    """The machine's memory in MiB."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**20


def _read(job: Job) -> bool:
    """Take in what the worker has said; False at the end of its output."""
    block = os.read(job.process.stdout.fileno(), 2**16)
    *lines, job.unread = (job.unread + block).split(b"\n")
    for line in lines:
        job.said |= json.loads(line)
    return bool(block)
