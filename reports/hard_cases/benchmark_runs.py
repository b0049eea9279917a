"""Which benchmark is run at which levels, and what the runs answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from compare.scene import BUDGETS
from reports.hard_cases import benchmark_tables as tables
from reports.hard_cases.chapter import OK, Asked, Case, Outcome

SOLVE = "hard_cases.benchmarks.solve"


@dataclass(frozen=True)
class Run:
    """One scene at one level: what a unit is asked, and from which budget on."""

    budget: str
    name: str
    solver: str
    about: dict[str, Any]
    level: dict[str, Any]


def _plate(budget: str, name: str, element: str, mesh: tuple[int, int], step: float = 1.0, **about: Any) -> Run:
    """A run of the plate solver; exact integration is kept for round reference shapes, the least points elsewhere."""
    least = (4, 5 if mesh[1] == 1 else 4, 3)
    points = (7, 7, 3) if name == "thick_plate" or element == "conforming" else least
    return Run(budget, name, "ancf", about, {"element": element, "mesh": mesh, "points": points, "time_step": step})


def _solid(budget: str, name: str, size: float, step: float = 1.0, **about: Any) -> Run:
    """A run of the reference."""
    return Run(budget, name, "reference", about, {"size": size, "time_step": step})


def _bricks(budget: str, elements: int, degree: int, law: str, **about: Any) -> Run:
    """A run of bricks that stand for a published program."""
    return Run(budget, "cook_rubber", "bricks", about, {"elements": elements, "degree": degree, "law": law})


STRESS, STRAIN, NEARLY = (
    {"plane": "stress", "nu": 1 / 3},
    {"plane": "strain", "nu": 1 / 3},
    {"plane": "strain", "nu": 0.4999},
)
THIN, THICK, BALL = ({"outer": b, "stretch": x} for b, x in ((1.1, 1.5), (2.0, 1.5), (1.1, 1.25)))
HELD, LOOSE = {"faces": "held"}, {"faces": "free"}
ANGLES = tuple(tables.PRINCETON_TIP)
OF_BOTH = ((8.896, 0), (8.896, 45), (8.896, 90), (13.345, 45))  # forces and angles of the reference
RUNS = (
    _plate("quick", "elastica", "enriched", (8, 1)),
    _plate("standard", "elastica", "enriched", (16, 1)),
    _plate("standard", "elastica", "conforming", (64, 1)),
    _solid("quick", "elastica", 0.5),
    _solid("full", "elastica", 0.25),
    _plate("quick", "roll_up", "enriched", (16, 1)),
    _plate("standard", "roll_up", "enriched", (32, 1)),
    _plate("standard", "roll_up", "conforming", (128, 1)),
    _solid("standard", "roll_up", 0.5, turns=0.25),
    _solid("full", "roll_up", 0.25, turns=0.5),
    _plate("quick", "corner_load", "enriched", (8, 8), 0.5),
    _plate("standard", "corner_load", "enriched", (16, 16), 0.5),
    _plate("standard", "corner_load", "conforming", (16, 16), 0.5),
    _solid("standard", "corner_load", 0.05),
    _solid("full", "corner_load", 0.035),
    _plate("quick", "princeton", "enriched", (32, 4), 0.5, force=13.345, angle=45),
    *(_plate("standard", "princeton", "enriched", (64, 4), 0.5, force=f, angle=a) for f, a in ANGLES),
    *(_solid("standard", "princeton", 0.012, force=f, angle=a) for f, a in OF_BOTH),
    *(_solid("full", "princeton", 0.006, force=f, angle=a) for f, a in ANGLES),
    _plate("quick", "cook", "enriched", (8, 8), **STRESS),
    *(_plate("standard", "cook", "enriched", (16, 16), **about) for about in (STRESS, STRAIN, NEARLY)),
    *(_plate("standard", "cook", "conforming", (16, 16), **about) for about in (STRESS, STRAIN, NEARLY)),
    _solid("quick", "cook", 4.0, **STRESS),
    *(_solid("standard", "cook", 2.0, **about) for about in (STRESS, STRAIN, NEARLY)),
    *(_solid("full", "cook", 1.0, **about) for about in (STRESS, STRAIN, NEARLY)),
    _plate("standard", "thick_plate", "enriched", (8, 8)),
    _solid("quick", "thick_plate", 0.4),
    _solid("standard", "thick_plate", 0.2),
    _solid("full", "thick_plate", 0.1),
    _plate("quick", "tube", "enriched", (2, 8), 0.1, **THIN),
    _plate("standard", "tube", "enriched", (2, 16), 0.1, **THIN),
    _plate("standard", "tube", "conforming", (2, 16), 0.1, **THIN),
    _solid("quick", "tube", 0.25, 0.1, **THICK),
    _solid("standard", "tube", 0.1, 0.1, **THIN),
    _plate("quick", "sphere", "enriched", (4, 4), 0.1, **BALL),
    _plate("standard", "sphere", "enriched", (8, 8), 0.1, **BALL),
    _plate("standard", "sphere", "conforming", (8, 8), 0.1, **BALL),
    _solid("standard", "sphere", 0.1, 0.1, **BALL),
    _plate("quick", "cook_rubber", "enriched", (4, 4), 0.1, **HELD),
    _plate("standard", "cook_rubber", "enriched", (16, 16), 0.1, **HELD),
    _solid("quick", "cook_rubber", 4.0, 0.1, **HELD),
    _solid("full", "cook_rubber", 2.0, 0.1, **HELD),
    _plate("quick", "cook_rubber", "enriched", (4, 4), 0.1, **LOOSE),
    _plate("standard", "cook_rubber", "enriched", (16, 16), 0.1, **LOOSE),
    *(_bricks("quick", n, degree, "gallery", **LOOSE) for degree in (1, 2) for n in (1, 2, 4)),
    *(_bricks("standard", 8, degree, "gallery", **LOOSE) for degree in (1, 2)),
    *(_bricks("full", 16, degree, "gallery", **LOOSE) for degree in (1, 2)),
    _bricks("standard", 8, 2, "ours", **HELD),
    _bricks("full", 16, 2, "ours", **HELD),
)


def asked(budget: str) -> list[Asked]:
    """One unit for each benchmark and solver, with all its runs that the budget pays for."""
    paid = [run for run in RUNS if run.budget in BUDGETS[: BUDGETS.index(budget) + 1]]
    found = []
    for (name, solver), runs in groupby(sorted(paid, key=_of), key=_of):
        plain = [{"about": run.about, "level": run.level} for run in runs]
        found.append(Asked(SOLVE, {"benchmark": name, "solver": solver, "runs": plain}))
    return found


def _of(run: Run) -> tuple[str, str]:
    return run.name, run.solver


@dataclass(frozen=True)
class Answer:
    """What one run found; without numbers where `status` is not ok."""

    solver: str
    about: dict[str, Any]
    level: dict[str, Any]
    status: str
    moves: dict[str, list[list[float]]]
    places: dict[str, list[float]]

    @property
    def element(self) -> str:
        """Element of the plate, "" of the solid."""
        return self.level.get("element", "")

    @property
    def words(self) -> str:
        """The level in words."""
        if self.solver == "ancf":
            return f"{self.element} {self.level['mesh'][0]}x{self.level['mesh'][1]}"
        if self.solver == "bricks":
            return f"Q{self.level['degree']} {self.level['elements']}x{self.level['elements']}"
        return f"h = {self.level['size']:g}"

    def at(self, probe: str, component: str, stage: int | None = None) -> float | None:
        """Displacement of a probe at a stage of the load, or at the last; None where the solve did not get there."""
        moves = self.moves.get(probe, [])
        if stage is None:
            stage = len(moves) - (self.status == OK)
        return moves[stage]["XYZ".index(component)] if stage < len(moves) else None

    def case(self, name: str, value: float | None, **more: Any) -> Case:
        """A case of this run."""
        status = self.status if value is None else OK
        return Case(f"{name}, {self.words}", self.solver, self.words, value, status=status, **more)


def answers(outcomes: Sequence[Outcome], name: str) -> Iterator[Answer]:
    """The answers of all runs of one benchmark; of a unit that died, its failure for each run that it was asked."""
    for outcome in outcomes:
        question = outcome.asked.arguments
        if question["benchmark"] != name:
            continue
        found = outcome.get("runs") or [{"status": outcome.measured.status}] * len(question["runs"])
        for run, one in zip(question["runs"], found, strict=True):
            moves, places = one.get("moves", {}), one.get("places", {})
            yield Answer(question["solver"], run["about"], run["level"], one["status"], moves, places)
