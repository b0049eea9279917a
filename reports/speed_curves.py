"""Work-precision curves: error against wall time of solvers and elements, and the cost of a stated error read off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.convergence import Convergence, study
from reports.unit import Measured

NAMES = {
    "enriched": "ANCF, enriched element",
    "conforming": "ANCF, conforming element",
    "reference": "reference",
    "calculix": "CalculiX",
}
ELEMENTS = ("enriched", "conforming")  # of ANCF; the cheaper one is judged
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
    """Levels of each series of NAMES, coarse to fine, and the value (m) that errors are measured from."""

    rows: dict[str, list[dict[str, Any]]]
    convergence: dict[str, Convergence]
    target: float | None
    target_words: str

    @staticmethod
    def of(measured: Measured, calculix: Sequence[Measured] = ()) -> Curves:
        """Curves of the unit "curve" and of runs of CalculiX.

        The target is the reference's Richardson value, or else its finest level.
        """
        found = [*(measured.get("rows") or []), *map(_of_calculix, calculix)]
        solved = {name: [r for r in found if r["series"] == name and r["status"] == "ok"] for name in NAMES}
        seen = {name: study([r["h"] for r in own], [r["height"] for r in own]) for name, own in solved.items()}
        best, levels = seen["reference"], solved["reference"]
        if best.extrapolated is not None:
            return Curves(solved, seen, best.extrapolated, "the reference's Richardson value")
        if best.fit is not None:
            return Curves(solved, seen, best.fit.extrapolated, "the limit of the reference's least squares fit")
        return Curves(solved, seen, levels[-1]["height"] if levels else None, "the reference's finest level")

    @property
    def drawn(self) -> list[str]:
        """The series that have levels and a target to measure their errors from."""
        return [name for name in NAMES if self.errors(name)]

    def errors(self, series: str) -> list[float]:
        """Percent of the target, by level."""
        return [100 * abs(row["height"] / self.target - 1) for row in self.rows[series]] if self.target else []

    def seconds(self, series: str, kind: str = "wall") -> list[float]:
        """Least wall or CPU seconds, by level."""
        return [row[f"{kind}_seconds"] for row in self.rows[series]]

    def cost(self, series: str, percent: float, kind: str = "wall") -> tuple[float | None, str]:
        """Wall or CPU seconds to an error, or why they are not known."""
        return cost_to(self.errors(series), self.seconds(series, kind), percent)

    def ratio(self, percent: float, kind: str = "wall", peer: str = "reference") -> tuple[float | None, str]:
        """A peer's cost over that of the cheaper ANCF element, and all costs in words."""
        found = {series: self.cost(series, percent, kind) for series in (*ELEMENTS, peer)}
        words = "; ".join(
            f"{NAMES[series]}: {f'{seconds:.3g} s' if seconds is not None else why}"
            for series, (seconds, why) in found.items()
        )
        ours = min((found[element][0] for element in ELEMENTS if found[element][0]), default=None)
        theirs = found[peer][0]
        return (theirs / ours if ours and theirs else None), words + "."

    def why(self, percent: float) -> list[str]:
        """What the first level of each series that stays within an error pays for, one sentence each."""
        return [words for series in NAMES for words in self._why(series, percent)]

    def first(self, series: str, percent: float) -> dict[str, Any] | None:
        """The coarsest level from which on the error stays within `percent`; None where it cannot be told."""
        above = [k for k, error in enumerate(self.errors(series)) if error > percent]
        return self.rows[series][above[-1] + 1] if above and above[-1] + 1 < len(self.rows[series]) else None

    def _why(self, series: str, percent: float) -> list[str]:
        row = self.first(series, percent)
        if row is None:
            return []
        words = f"{NAMES[series]}: within {percent:g} % from {row['mesh']} on: {row['unknowns']} unknowns"
        if row["newton_iterations"] is None:
            return [f"{words}, {row['steps']} steps."]
        iterations, each = row["newton_iterations"], row["wall_seconds"] / row["newton_iterations"]
        return [
            f"{words}, {row['steps']} steps, {iterations} Newton iterations, {row['factorisations']} factorisations, "
            f"{1e3 * each:.2g} ms an iteration, {1e6 * each / row['unknowns']:.2g} µs an iteration and unknown."
        ]

    def costs(self) -> list[dict[str, Any]]:
        """Cost of each series to each of COSTS, with the reason where there is none."""
        return [
            {"solver": series, "percent": percent, "seconds": seconds, "cpu_seconds": cpu, "refused": why or None}
            for percent in COSTS
            for series in NAMES
            for (seconds, why), (cpu, _) in [[self.cost(series, percent, kind) for kind in ("wall", "cpu")]]
        ]


def _of_calculix(run: Measured) -> dict[str, Any]:
    """A run of CalculiX as a row of a curve."""
    names = ("unknowns", "height", "wall_seconds", "cpu_seconds", "steps", "peak_mb")
    size = run.arguments["size"]
    own = {"series": "calculix", "mesh": f"h={size:g}", "h": size, "status": run.status}
    return {**own, **{name: run.get(name) for name in names}, "newton_iterations": None, "factorisations": None}


def cheapest(rows: Sequence[dict[str, Any]], series: str, target: float, percent: float, kind: str = "wall"):
    """The row of a series that is within `percent` of the target (m) in the least time, None where none is."""
    within = [row for row in rows if row["series"] == series and abs(row["height"] / target - 1) <= percent / 100]
    return min(within, key=lambda row: row[f"{kind}_seconds"], default=None)
