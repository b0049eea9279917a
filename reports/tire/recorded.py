"""The finest solids of a full study, kept beside the baselines: a short study carries its ladder on with them.

The order of the solid's travel settles only at 0.062 m, which takes 25 minutes of CPU. A study that stops at coarser
solids extrapolates to a limit that the plate has left behind. So limits are those of the whole ladder: what a study
ran itself, and beyond its finest solid what a full study recorded (`python -m reports.tire --budget full --record
REASON`). Recorded are numbers and paths; what a solid costs is told by solids that were run.

A record is used only where a study ran one of its solids too and found the same travel and peak force. Another scene
or another solver finds others.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.files import write_text
from compare.gate import ACROSS
from compare.provenance import provenance
from reports.frame import BASELINES
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire.limits import ladder
from reports.unit import Measured

FILE = BASELINES / "tire_solids.json"
KEYS = ("ended", "h", "elements", "unknowns", "travel", "peak_force", "footprint", "lowest_ratio", "steps")
KEYS += ("iterations_per_step", "energy_residual", "times", "node_1", "ratio")
COMPARED = ("travel", "peak_force")


def write(outcomes: Sequence[Outcome], reason: str, path: Path = FILE) -> None:
    """Record the solids among the runs that ended well, with the reason, the date and the commit."""
    about = provenance()
    solids = [
        {"unit": o.measured.command, "name": o.asked.name, "arguments": o.asked.arguments}
        | {"values": {key: o.get(key) for key in KEYS}}
        for o in ladder(outcomes, "reference").outcomes
    ]
    made = {"reason": reason, **{key: about[key] for key in ("date", "commit", "versions")}}
    write_text(path, json.dumps({"made": made, "solids": solids}, indent=1, allow_nan=False) + "\n")


def read(path: Path = FILE) -> tuple[Outcome, ...]:
    """The recorded solids, coarse to fine; none without a record."""
    if not path.exists():
        return ()
    held = json.loads(path.read_text(encoding="utf-8"))["solids"]
    return tuple(_outcome(own) for own in held)


def _outcome(held: dict[str, Any]) -> Outcome:
    name, told = held["name"], held["arguments"]
    return Outcome(Asked(name, told), Measured(name, told, "ok", held["values"]))


def finer(outcomes: Sequence[Outcome], path: Path = FILE) -> tuple[Outcome, ...]:
    """The recorded solids beyond the finest that was run; none where those that both have differ, or none is."""
    run = {o.get("h"): o for o in ladder(outcomes, "reference").outcomes}
    held = read(path)
    both = [(run[o.get("h")], o) for o in held if o.get("h") in run]
    if not both or not all(_same(own, other) for own, other in both):
        return ()
    return tuple(o for o in held if o.get("h") < min(run))


def _same(one: Outcome, other: Outcome) -> bool:
    return all(abs(one.get(key) / other.get(key) - 1) <= ACROSS for key in COMPARED)
