"""The finest solids of a full study, kept beside the baselines: a short study carries its ladder on with them.

The order of the solid's travel settles only at 0.062 m, which takes 25 minutes of CPU. A study that stops at coarser
solids extrapolates to a limit that the plate has left behind. So limits are those of the whole ladder: what a study
ran itself, and beyond its finest solid what a full study recorded (`python -m reports.tire --budget full --record
REASON`). Recorded are numbers and paths; what a solid costs is told by solids that were run.

A record is used only where a study ran one of its solids too and found the same. Another scene, another solver or
another mesh find other numbers.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compare.files import write_text
from compare.gate import ACROSS
from compare.provenance import provenance
from reports.frame import BASELINES
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire.limits import ladder
from reports.unit import Measured

FILE = BASELINES / "tire_solids.json"
NUMBERS, PATHS = ("travel", "peak_force", "footprint"), ("node_1", "ratio")
KEYS = ("ended", "h", "elements", "unknowns", *NUMBERS, "lowest_ratio", "energy_residual", "steps")
KEYS += ("iterations_per_step", "times", *PATHS)


class Record(NamedTuple):
    """Solids coarse to fine, and in words when and why they were recorded, or why none of a record is used."""

    solids: tuple[Outcome, ...]
    words: str


def write(outcomes: Sequence[Outcome], reason: str, path: Path = FILE) -> None:
    """Record the solids among the runs that ended well, with the reason, the date and the commit.

    Raises ValueError where a number is not finite.
    """
    about, solids = provenance(), ladder(outcomes, "reference").outcomes
    made = {"reason": reason, **{key: about[key] for key in ("date", "commit", "versions")}}
    told = [
        {"name": o.asked.name, "arguments": o.asked.arguments, "values": {key: o.get(key) for key in KEYS}}
        for o in solids
    ]
    write_text(path, json.dumps({"made": made, "solids": told}, allow_nan=False).replace('{"name"', '\n{"name"') + "\n")


def read(path: Path = FILE) -> Record:
    """What is recorded."""
    if not path.exists():
        return Record((), "No solids are recorded.")
    held = json.loads(path.read_text(encoding="utf-8"))
    made, solids = held["made"], []
    for own in held["solids"]:
        name, told = own["name"], own["arguments"]
        solids.append(Outcome(Asked(name, told), Measured(name, told, "ok", own["values"])))
    return Record(tuple(solids), f"recorded on {made['date'][:10]} at commit {made['commit']}: {made['reason']}")


def beyond(outcomes: Sequence[Outcome]) -> Record:
    """The recorded solids that are finer than those among the runs; none where a solid that both have differs."""
    held, run = read(), {o.get("h"): o for o in ladder(outcomes, "reference").outcomes}
    both = [(run[o.get("h")], o) for o in held.solids if o.get("h") in run]
    if not held.solids:
        return held
    if not both:
        return Record((), "No recorded solid is used, since none was run here too.")
    for own, other in both:
        if why := _difference(own, other):
            return Record((), f"No recorded solid is used, since at h = {own.get('h'):g} m {why}.")
    finer = tuple(o for o in held.solids if o.get("h") < min(run))
    sizes = ", ".join(f"{o.get('h'):g}" for o in finer)
    return Record(finer, f"The ladder goes on with solids of h = {sizes} m, {held.words}." if finer else "")


def _difference(one: Outcome, other: Outcome) -> str:
    """In what a run is not the recorded one, in words; nothing where it is."""
    if one.asked.arguments != other.asked.arguments or one.get("times") != other.get("times"):
        return "the record is of another question"
    for key in (*NUMBERS, *PATHS):
        own, held = np.array(one.get(key)), np.array(other.get(key))
        apart = np.abs(own - held).max() / np.abs(held).max()
        if not apart <= ACROSS:
            return f"its {key.replace('_', ' ')} differs by {apart:.1e}"
    return ""
