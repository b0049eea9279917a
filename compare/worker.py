"""One unit of a study in a process of its own: a crash, a leak or a thread count stays inside.

The parent starts `python -m compare.worker` with the thread limits already in the environment,
writes one pickled Task to its standard input and reads JSON lines from its standard output:
{"fraction": 0.4} while it works, then {"done": true} or {"error": "...", "trace": "..."}; {"too_large": MB} where
it is not begun.
Whatever a solver prints goes to standard error instead.
"""

from __future__ import annotations

import faulthandler
import importlib
import json
import os
import pickle
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

CHEAP = 2.0  # s: a unit is repeated until its runs have taken this long together
REPEATS = 3  # runs of a cheap unit at most, the least wall time is kept
PERIOD = 0.1  # s between two reports of progress


@dataclass(frozen=True)
class Task:
    """What a worker is asked: kind "solve" (level, path) or "estimate" (levels of several scenes).

    solver: dotted name of a module with solve(scene, level, progress) and estimate(scene, level).
    questions: pairs (Scene, level). path: where the one Result of "solve" goes. beside: whether other units may run
    at the same time. most_mb: what it may be expected to need, where nobody has estimated that before.
    """

    kind: str
    solver: str
    questions: tuple[tuple[Any, Any], ...]
    path: Path | None = None
    beside: bool = False
    most_mb: float | None = None


def main() -> int:
    """Do the task on standard input; exit status 0 done, 1 an exception was reported."""
    lines = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)
    faulthandler.enable()  # a crash in compiled code leaves its Python lines in the message
    task = pickle.load(sys.stdin.buffer)
    try:
        module = importlib.import_module(task.solver)
        if task.kind == "estimate":
            found = [module.estimate(scene, level) for scene, level in task.questions]
            _tell(lines, {"estimates": found})
        elif needed := excess(module, task):
            _tell(lines, {"too_large": needed})
        else:
            solve(module, task, lines)
        _tell(lines, {"done": True})
    except Exception as error:
        _tell(lines, {"error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()})
        return 1
    return 0


def excess(module: Any, task: Task) -> float | None:
    """Memory (MB) that a unit is expected to need, where that is more than it may."""
    if task.most_mb is None:
        return None
    try:
        needed = module.estimate(*task.questions[0]).get("memory_mb") or 0.0
    except Exception:  # a solver that cannot tell is let try
        return None
    return needed if needed > task.most_mb else None


def solve(module: Any, task: Task, lines: IO[str]) -> None:
    """Solve, up to REPEATS times when cheap, and save the Result with its least wall time.

    Result.seconds becomes the least wall time (s) of the runs, facts["repeats"] their number,
    facts["beside"] 1 where another unit may have run at the same time, and
    peak_mb the largest resident size of this process (MiB), interpreter and libraries included.
    """
    from compare.result import save

    (scene, level), seconds = task.questions[0], []
    while True:
        begin = time.perf_counter()
        result = module.solve(scene, level, progress=None if seconds else _reporter(lines))
        seconds.append(time.perf_counter() - begin)
        if sum(seconds) >= CHEAP or len(seconds) == REPEATS:
            break
    facts = {**result.facts, "repeats": len(seconds), "beside": float(task.beside)}
    save(replace(result, seconds=min(seconds), facts=facts, peak_mb=peak_mb()), task.path)


def peak_mb() -> float:
    """Largest resident size of this process so far, MiB."""
    import resource

    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def _reporter(lines: IO[str]) -> Callable[..., None]:
    """A progress callback: the fraction done, 0 to 1, told at most every PERIOD seconds."""
    told = 0.0

    def progress(fraction: float, *_: object) -> None:
        nonlocal told
        now = time.monotonic()
        if now - told >= PERIOD:
            told = now
            _tell(lines, {"fraction": float(fraction)})

    return progress


def _tell(lines: IO[str], message: dict[str, Any]) -> None:
    lines.write(json.dumps(message) + "\n")
    lines.flush()


if __name__ == "__main__":
    sys.exit(main())
