"""What a chapter of the hard cases is made of: units to run, cases judged, and the blocks of its section."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from compare.report import Block, Column, Table
from compare.verdict import Figure
from reports.unit import Measured

OK = "ok"


@dataclass(frozen=True)
class Asked:
    """One unit to run: a function (**arguments) -> dict of numbers and words, "module.function" below `reports`."""

    name: str
    arguments: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """One hard case: what came out, what was expected, and how far apart they may be.

    name: unique in its chapter; a baseline knows the case by it. solver: "ancf" or "reference", with what
    it ran behind it in `level`. allowed: largest |value - expected|, in percent of |expected|; None asks
    nothing. against: "exact: ...", "published: ..." or "cross-code: ...", with the reason of the tolerance.
    status: "ok" or the name of a failure. may_fail: the failures that the case may show (value is None then);
    any other name, a crash above all, is a miss.
    """

    name: str
    solver: str
    level: str
    value: float | None
    unit: str
    expected: float | None = None
    allowed: float | None = None
    against: str = ""
    status: str = OK
    may_fail: tuple[str, ...] = ()

    @property
    def difference(self) -> float | None:
        """(value - expected) in percent of |expected|."""
        if self.value is None or not self.expected:
            return None
        return 100 * (self.value - self.expected) / abs(self.expected)

    @property
    def met(self) -> bool | None:
        """Whether the case is within its tolerance; None where nothing is asked. A failure is not met."""
        if self.status != OK or self.value is None or not math.isfinite(self.value):
            return self.status in self.may_fail
        if self.allowed is None:
            return None
        return self.difference is not None and abs(self.difference) <= self.allowed

    def row(self) -> dict[str, Any]:
        """The case as a row of a table and of the JSON."""
        verdict = {True: "met", False: "missed", None: "shown"}[self.met]
        return {**vars(self), "difference": self.difference, "margin": self.margin, "verdict": verdict}

    @property
    def margin(self) -> float | None:
        """Percent of |expected| that is left of the tolerance."""
        if self.allowed is None or self.difference is None:
            return None
        return self.allowed - abs(self.difference)


CASES = (
    Column("name", "case", "wrap"),
    Column("solver", "solver"),
    Column("level", "level"),
    Column("value", "value", ".6g"),
    Column("expected", "expected", ".6g"),
    Column("unit", "unit"),
    Column("difference", "difference", "+.3g", "%"),
    Column("allowed", "allowed", ".3g", "%"),
    Column("margin", "margin", "+.2g", "%"),
    Column("verdict", "verdict"),
    Column("against", "against", "wrap"),
    Column("status", "status"),
)


def case_table(caption: str, cases: Sequence[Case], notes: Sequence[str] = ()) -> Table:
    """The cases as a table; columns that no case fills are left out."""
    rows = [case.row() for case in cases]
    columns = [c for c in CASES if any(row.get(c.key) not in (None, "") for row in rows)]
    return Table(caption, columns, rows, notes)


@dataclass(frozen=True)
class Chapter:
    """What a chapter shows: cases for the gate and the count of failures, figures it is judged by, its blocks."""

    cases: Sequence[Case] = ()
    figures: Sequence[Figure] = ()
    blocks: Sequence[Block] = ()


@dataclass(frozen=True)
class Outcome:
    """What became of a unit."""

    asked: Asked
    measured: Measured

    @property
    def ok(self) -> bool:
        """Whether there are numbers."""
        return self.measured.ok

    def get(self, name: str) -> Any:
        """A value of the unit, None where there is none."""
        return self.measured.get(name)
