"""One measurement in a process of its own with one thread: what an exhibit runs, and how to run it alone.

    python -m reports.unit NAME key=value ...

prints what the unit measured as JSON. Values are JSON where they parse as such and words otherwise. A unit is
a function (**arguments) -> dict of numbers and words; its name is its module below `reports` and its own, for
example speed_runs.ancf. Its "status", where it returns one, is "ok" or the name of a failure.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from compare.pool import THREADS
from compare.worker import peak_mb

PYTHON = os.path.relpath(sys.executable) if sys.executable.startswith(os.getcwd()) else sys.executable
TAIL = 2000  # characters of a failed unit's standard error that are kept


@dataclass(frozen=True)
class Measured:
    """What a unit measured, or why it did not.

    values: numbers and words by name; "process_cpu_seconds", "process_wall_seconds" and "peak_mb" (MiB) are
    of its whole process, interpreter and imports included. status: "ok", "absent: ..." or "failed: ...".
    """

    name: str
    arguments: dict[str, Any]
    status: str
    values: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether there are numbers."""
        return self.status == "ok"

    @property
    def command(self) -> str:
        """What to type to measure it again."""
        return command(self.name, self.arguments)

    def get(self, name: str) -> Any:
        """A value, None where there is none."""
        return self.values.get(name)


def command(name: str, arguments: dict[str, Any]) -> str:
    """What to type to run a unit alone."""
    words = [f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in arguments.items()]
    return " ".join([PYTHON, "-m", "reports.unit", name, *(_quoted(word) for word in words)])


def _quoted(word: str) -> str:
    return f"'{word}'" if set(word) & set(' []{}"') else word


def measure(name: str, **arguments: Any) -> Measured:
    """Run a unit in a fresh process and wait for it."""
    words = [f"{key}={json.dumps(value)}" for key, value in arguments.items()]
    begin = time.perf_counter()
    run = subprocess.run([sys.executable, "-m", __name__, name, *words], capture_output=True, text=True)
    wall = time.perf_counter() - begin
    try:
        values = json.loads(run.stdout)
    except json.JSONDecodeError:
        said = run.stderr.strip()
        last = said.splitlines()[-1] if said else f"exit status {run.returncode}"
        return Measured(name, arguments, f"failed: {last}", {"trace": said[-TAIL:]})
    status = values.pop("status", "ok")
    return Measured(name, arguments, status, {**values, "process_wall_seconds": wall})


def measurements(found: dict[str, Any]) -> list[Measured]:
    """All measurements in the lists and values of a dict, in order."""
    values = [item for value in found.values() for item in (value if isinstance(value, list) else [value])]
    return [value for value in values if isinstance(value, Measured)]


def main(words: Sequence[str] | None = None) -> int:
    """Measure one unit in this process and print it."""
    name, *pairs = sys.argv[1:] if words is None else words
    os.environ |= dict.fromkeys(THREADS, "1")  # before NumPy is loaded
    arguments = {key: _value(text) for key, _, text in (pair.partition("=") for pair in pairs)}
    module, _, function = f"reports.{name}".rpartition(".")
    lines = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what a solver prints is no measurement
    values = getattr(importlib.import_module(module), function)(**arguments)
    values |= {"process_cpu_seconds": time.process_time(), "peak_mb": peak_mb()}
    print(json.dumps(values, indent=1), file=lines)
    return 0


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


if __name__ == "__main__":
    sys.exit(main())
