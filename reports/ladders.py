"""Ladders: the levels of each scene and solver, what they tend to, and the known heights beside them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from compare.convergence import Convergence
from compare.exact import cross_code, published
from compare.provenance import provenance
from compare.scene import BUDGETS, Scene
from compare.study import Entry
from compare.table import (
    answer,
    coarse_first,
    convergences,
    digits,
    element,
    error,
    in_ladders,
    kind,
    rule,
    sensitivity,
    series,
    unit,
)
from compare.verdict import Figure

NAMES = {"ancf": "ANCF", "reference": "reference"}


@dataclass(frozen=True)
class Ladder:
    """One series of levels of one scene, mode (None where the answer is a height) and solver, coarse to fine."""

    scene: Scene
    entries: tuple[Entry, ...]
    label: str
    role: str
    convergence: Convergence

    @property
    def solver(self) -> str:
        """ "ancf" or "reference"."""
        return self.entries[0].solver

    @property
    def mode(self) -> int | None:
        """Number of the natural frequency."""
        return self.entries[0].mode

    @property
    def solved(self) -> tuple[Entry, ...]:
        """Levels that succeeded."""
        return tuple(entry for entry in self.entries if entry.ok)

    @property
    def h(self) -> list[float]:
        """Element lengths (m)."""
        return [entry.result.h for entry in self.solved]

    @property
    def values(self) -> list[float]:
        """Answers: heights (m) of the answer probe, or frequencies (Hz) of the mode."""
        return [answer(entry) for entry in self.solved]

    @property
    def finest(self) -> Entry | None:
        """Finest level that succeeded."""
        return self.solved[-1] if self.solved else None

    def errors(self, target: float) -> list[float] | None:
        """Sizes of the levels' differences from a value (percent); None where they are not known, see `table.error`."""
        found = [error(entry, target) for entry in self.solved]
        return None if None in found else [abs(each) for each in found]


def named(solver: str) -> str:
    """Name of a solver for people; a third one is called as it calls itself."""
    return NAMES.get(solver, {"calculix": "CalculiX"}.get(solver, solver))


def ladders(entries: Sequence[Entry], scene: str) -> list[Ladder]:
    """The series of a scene, in the order of its entries; the first ANCF series is the one drawn boldest."""
    groups: dict[Any, list[Entry]] = {}
    for entry in in_ladders(list(entries)):
        if entry.scene.name == scene:
            groups.setdefault(series(entry), []).append(entry)
    found, plain = [], set()
    for stated in groups.values():
        members, mode = coarse_first(stated), stated[0].mode
        role = "reference" if members[0].solver in NAMES else "third"
        if members[0].solver == "ancf":
            role = "ancf exact" if mode in plain else "ancf"
            plain.add(mode)
        label = _label(members[0], [other[0] for other in groups.values() if other[0].mode == mode])
        found.append(Ladder(members[0].scene, tuple(members), label, role, convergences(members)[-1]))
    return found


def by_mode(found: Sequence[Ladder]) -> list[list[Ladder]]:
    """The ladders of a scene, those of one mode together; all of them where the answer is a height."""
    groups: dict[int | None, list[Ladder]] = {}
    for ladder in found:
        groups.setdefault(ladder.mode, []).append(ladder)
    return list(groups.values())


def scenes(entries: Iterable[Entry]) -> list[Scene]:
    """The scenes of a study as stated, each once, in the order of the entries."""
    found = {entry.scene.name: entry.scene for entry in in_ladders(list(entries))}
    return list(found.values())


def budget(entries: Iterable[Entry]) -> str:
    """The largest budget that a level of these entries asks for."""
    return max((entry.level.budget for entry in in_ladders(list(entries))), key=BUDGETS.index)


def _label(entry: Entry, others: Sequence[Entry]) -> str:
    """Name of a series beside one entry of each: its solver, of ANCF the rule and the element if it is not the paper's,
    and what else tells it from one of that name."""
    alike = [other for other in others if _name(other) == _name(entry)]
    kinds = [kind(other.level) for other in alike]
    differing = [key for key in kind(entry.level) if len({own[key] for own in kinds}) > 1]
    told = [f"{key.replace('_', ' ')} {kind(entry.level)[key]}" for key in differing]
    return ", ".join([_name(entry), *told])


def _name(entry: Entry) -> str:
    if entry.solver != "ancf":
        return named(entry.solver)
    words = ["ANCF", element(entry.level), rule(entry.level)]
    return " ".join(word for word in words if word != "conforming")


def band_words(ladder: Ladder) -> str:
    """The ladder's own band in words, or why there is none."""
    seen = ladder.convergence
    if seen.band is None:
        return f"No band: {seen.refused}."
    form = digits(ladder.values, seen.rest)
    limits = f"{seen.band.lower:{form}} to {seen.band.upper:{form}} {unit(ladder.scene)}".replace("-", "\u2212")
    order = f"order {seen.order:.2f}"
    if seen.taken < seen.order:
        order += f" (band drawn with {seen.taken:.2f}, the limit at re-entrant edges)"
    return f"Band {limits} around the finest value, {order}, {seen.sequence}."


def page_content(entries: Sequence[Entry], rows: Sequence[dict[str, Any]], judged: Sequence[Figure]) -> dict[str, Any]:
    """What the JSON of a page holds."""
    return {
        "figures": {figure.name: figure.entry() for figure in judged},
        "notes": {figure.name: figure.words() for figure in judged},
        "rows": list(rows),
        "error_limit_percent": limit_errors(entries),
        "convergence": convergence(entries),
        "opinions": opinions(entries),
        "sensitivity": sensitivity(list(entries)),
        "provenance": {"budget": budget(entries), **provenance()},
    }


def convergence(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """What each ladder says about its limit: sequence type, order, Richardson value and band, or the refusal."""
    return [
        {
            "scene": ladder.scene.name,
            "ladder": ladder.label,
            "mode": ladder.mode,
            "unit": unit(ladder.scene),
            "levels": len(ladder.solved),
            "sequence": ladder.convergence.sequence,
            "order": ladder.convergence.order,
            "taken": ladder.convergence.taken,
            "extrapolated": ladder.convergence.extrapolated,
            "lower": ladder.convergence.band and ladder.convergence.band.lower,
            "upper": ladder.convergence.band and ladder.convergence.band.upper,
            "gci_percent": ladder.convergence.gci_percent,
            "refused": ladder.convergence.refused,
        }
        for scene in scenes(entries)
        for ladder in ladders(entries, scene.name)
    ]


def limit_errors(entries: Sequence[Entry]) -> list[float | None]:
    """For each row of the table its difference from its own series' Richardson value (percent), None without one."""
    limits = {
        series(ladder.entries[0]): ladder.convergence.extrapolated
        for scene in scenes(entries)
        for ladder in ladders(entries, scene.name)
    }
    return [error(entry, limits[series(entry)]) for entry in in_ladders(list(entries))]


def opinions(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Known heights (m) for the scenes' own questions, with each solver's finest level against them (percent)."""
    found = []
    for scene in scenes(entries):
        finest = {}
        for ladder in ladders(entries, scene.name):
            finest.setdefault(ladder.solver, ladder.finest)
        for value in (*published(scene), *cross_code(scene)):
            if value.mesh is None:
                line = {"scene": scene.name, "kind": value.kind, "source": value.source, "cell": value.cell}
                line |= {"value": value.value}
                line |= {f"{solver}_percent": error(finest.get(solver), value.value) for solver in NAMES}
                found.append(line)
    return found


def error_target(found: Sequence[Ladder]) -> tuple[float, str] | None:
    """The value that plotted errors are measured from, and what it is: the best that there is.

    First the reference's Richardson value, then the printed converged value, then finest levels.
    """
    best = sorted(found, key=lambda ladder: ladder.solver != "reference")
    if best and best[0].solver == "reference" and best[0].convergence.extrapolated is not None:
        return best[0].convergence.extrapolated, "the Richardson value of the reference"
    stated = best[0].scene.published if best else None
    if stated and stated.converged:
        return stated.converged.value, f"the printed value ({stated.converged.cell})"
    for ladder in best:
        if ladder.finest:
            return answer(ladder.finest), f"the finest {ladder.label} level"
    return None
