"""Work-precision curves: error against wall time of both solvers, and the cost of a stated error read off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.convergence import Convergence, study
from reports.unit import Measured

NAMES = {"ancf": "ANCF", "reference": "reference"}
COSTS = (1.0, 0.1)  # percent


def cost_to(errors: Sequence[float], seconds: Sequence[float], percent: float) -> tuple[float | None, str]:
    """Seconds at which the error (percent, coarse to fine) stays below `percent`, or None and why.

    Logarithmic interpolation between the last level above and the next one; nothing is extrapolated.

        >>> cost_to([10.0, 1.0, 0.1], [1.0, 4.0, 16.0], 1.0)
        (4.0, '')
        >>> cost_to([0.5, 0.1], [1.0, 4.0], 1.0)
        (None, 'the coarsest level is already within 1 %')
    """
    above = [k for k, error in enumerate(errors) if error > percent]
    if not errors:
        return None, "no level succeeded"
    if not above:
        return None, f"the coarsest level is already within {percent:g} %"
    k = above[-1]
    if k == len(errors) - 1:
        return None, f"the finest level is still {errors[-1]:.2g} % away"
    low, high = np.log(max(errors[k + 1], 1e-12)), np.log(errors[k])
    part = (high - np.log(percent)) / (high - low)
    return float(np.exp((1 - part) * np.log(seconds[k]) + part * np.log(seconds[k + 1]))), ""


@dataclass(frozen=True)
class Curves:
    """Levels of both solvers, coarse to fine, and the value (m) that errors are measured from."""

    rows: dict[str, list[dict[str, Any]]]
    convergence: dict[str, Convergence]
    target: float | None
    target_words: str

    @staticmethod
    def of(measured: Measured) -> Curves:
        """Curves of the unit "curve"; the target is the reference's Richardson value, or else its finest level."""
        rows = {name: [r for r in measured.get("rows") or [] if r["solver"] == name] for name in NAMES}
        solved = {name: [row for row in found if row["status"] == "ok"] for name, found in rows.items()}
        seen = {name: study([r["h"] for r in found], [r["height"] for r in found]) for name, found in solved.items()}
        best, levels = seen["reference"], solved["reference"]
        if best.extrapolated is not None:
            return Curves(solved, seen, best.extrapolated, "the reference's Richardson value")
        if best.fit is not None:
            return Curves(solved, seen, best.fit.extrapolated, "the limit of the reference's least squares fit")
        return Curves(solved, seen, levels[-1]["height"] if levels else None, "the reference's finest level")

    def errors(self, solver: str) -> list[float]:
        """Percent of the target, by level."""
        return [100 * abs(row["height"] / self.target - 1) for row in self.rows[solver]] if self.target else []

    def seconds(self, solver: str, kind: str = "wall") -> list[float]:
        """Least wall or CPU seconds, by level."""
        return [row[f"{kind}_seconds"] for row in self.rows[solver]]

    def cost(self, solver: str, percent: float, kind: str = "wall") -> tuple[float | None, str]:
        """Wall or CPU seconds to an error, or why they are not known."""
        return cost_to(self.errors(solver), self.seconds(solver, kind), percent)

    def ratio(self, percent: float, kind: str = "wall") -> tuple[float | None, str]:
        """Reference over ANCF, and both costs in words."""
        found = {solver: self.cost(solver, percent, kind) for solver in NAMES}
        words = "; ".join(
            f"{NAMES[solver]}: {f'{seconds:.3g} s' if seconds is not None else why}"
            for solver, (seconds, why) in found.items()
        )
        (ours, _), (theirs, _) = found["ancf"], found["reference"]
        return (theirs / ours if ours and theirs else None), words + "."

    def why(self, percent: float) -> list[str]:
        """What each solver's first level that stays within an error pays for, one sentence each."""
        return [words for solver in NAMES for words in self._why(solver, percent)]

    def _why(self, solver: str, percent: float) -> list[str]:
        above = [k for k, error in enumerate(self.errors(solver)) if error > percent]
        if not above or above[-1] + 1 == len(self.rows[solver]):
            return []
        row = self.rows[solver][above[-1] + 1]
        iterations, each = row["newton_iterations"], row["wall_seconds"] / row["newton_iterations"]
        return [
            f"{NAMES[solver]}: within {percent:g} % from {row['mesh']} on: {row['unknowns']} unknowns, "
            f"{row['steps']} steps, {iterations} Newton iterations with {row['factorisations']} factorisations, "
            f"{1e3 * each:.2g} ms an iteration, {1e6 * each / row['unknowns']:.2g} µs an iteration and unknown."
        ]

    def costs(self) -> list[dict[str, Any]]:
        """Cost of each solver to each of COSTS, with the reason where there is none."""
        return [
            {"solver": solver, "percent": percent, "seconds": seconds, "cpu_seconds": cpu, "refused": why or None}
            for percent in COSTS
            for solver in NAMES
            for (seconds, why), (cpu, _) in [[self.cost(solver, percent, kind) for kind in ("wall", "cpu")]]
        ]
