"""What the reference's ladder tends to: numbers and whole histories, with the order that was observed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.convergence import Convergence, study
from reports.hard_cases.chapter import Outcome

ORDERS = (1.0, 4.0)  # of a history's limit: lower ones would carry it further than the ladder shows


@dataclass(frozen=True)
class Ladder:
    """Good runs of one solver, coarse to fine, and element lengths h."""

    outcomes: tuple[Outcome, ...]

    @property
    def h(self) -> list[float]:
        """Element length of each, relative to the finest."""
        sizes = [o.get("h") for o in self.outcomes]
        return [size / sizes[-1] for size in sizes]

    def convergence(self, key: str) -> Convergence:
        """That of a number."""
        return study(self.h, [o.get(key) for o in self.outcomes])

    def limit(self, key: str) -> tuple[float, str]:
        """Extrapolated value of a number and how it was found; the finest value where there is no order to trust."""
        found = self.convergence(key)
        if found.extrapolated is not None:
            return found.extrapolated, f"extrapolated with order {found.taken:.2f}"
        return self.outcomes[-1].get(key), f"finest value ({found.refused})"

    def history(self, key: str, order: float | None) -> np.ndarray:
        """Extrapolated history with the order of another number; the finest one without an order."""
        finest = np.array(self.outcomes[-1].get(key))
        if order is None or len(self.outcomes) < 2:
            return finest
        coarser = np.array(self.outcomes[-2].get(key))
        taken = float(np.clip(order, *ORDERS))
        return finest + (finest - coarser) / ((self.h[-2] / self.h[-1]) ** taken - 1)


def ladder(outcomes: Sequence[Outcome], solver: str, fitted: bool = False) -> Ladder:
    """The runs of a solver that ended well; fitted: those with grid lines on groove edges, else those without."""
    own = [o for o in outcomes if o.asked.arguments.get("solver", "ancf") == solver and o.ok and o.get("ended") == "ok"]
    own = [o for o in own if ("fit" in o.asked.arguments) == fitted]
    return Ladder(tuple(sorted(own, key=lambda o: -o.get("h"))))


def error(outcome: Outcome, limit: np.ndarray, key: str = "node_1") -> float:
    """Greatest difference of a path from the limit, in percent of the limit's travel."""
    return float(100 * np.abs(np.array(outcome.get(key)) - limit).max() / np.abs(limit).max())


def cost_at(errors: Sequence[float], seconds: Sequence[float], wanted: float) -> float | None:
    """Seconds at which a ladder has an error, on the straight line through its logarithms; None of fewer than two.

    A run that is the limit itself has no error and no place on the line.
    """
    pairs = [(np.log(e), np.log(s)) for e, s in zip(errors, seconds, strict=True) if e > 0]
    if len(pairs) < 2 or wanted <= 0:
        return None
    slope, start = np.polyfit(*np.array(pairs).T, 1)
    return float(np.exp(start + slope * np.log(wanted)))
