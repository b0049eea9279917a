"""Verdict: a figure against its bar, met, missed or not run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Figure:
    """One number the study is judged by.

    value and bar in `unit`; met: None where the value was not run or nothing is asked of it.
    against: what the value is judged by ("published: Table 5 ...", "cross-code: ..."). note: what a
    reader must know to use it. form: how the page prints it. asked: what is asked, where that is no bar
    that the value must not exceed. least: the value must reach the bar instead.
    """

    name: str
    label: str
    value: float | None
    unit: str
    bar: float | None
    met: bool | None
    against: str
    note: str = ""
    form: str = ".3g"
    asked: str = ""
    least: bool = False

    @property
    def judged(self) -> bool:
        """Whether anything is asked of the figure."""
        return self.bar is not None or bool(self.asked)

    @property
    def margin(self) -> float | None:
        """How much of the bar is left, in `unit`; negative where it was missed."""
        if self.value is None or self.bar is None:
            return None
        return self.value - self.bar if self.least else self.bar - self.value

    def entry(self) -> dict[str, Any]:
        """The figure as the study's JSON keeps it."""
        return {"value": self.value, "unit": self.unit, "bar": self.bar, "met": self.met}

    def words(self) -> dict[str, Any]:
        """What the figure is, what it is judged by, what is left of its bar and what to know about it."""
        return {"label": self.label, "against": self.against, "margin": self.margin, "note": self.note}


def at_most(name: str, label: str, value: float | None, unit: str, bar: float, **more: str) -> Figure:
    """A figure that must not exceed its bar."""
    met = None if value is None else bool(value <= bar)
    return Figure(name, label, value, unit, bar, met, **more)


def at_least(name: str, label: str, value: float | None, unit: str, bar: float, **more: str) -> Figure:
    """A figure that must reach its bar."""
    met = None if value is None else bool(value >= bar)
    return Figure(name, label, value, unit, bar, met, asked=f"at least {bar:g}", least=True, **more)


def stated(name: str, label: str, value: float | None, unit: str, **more: str) -> Figure:
    """A figure of which nothing is asked."""
    return Figure(name, label, value, unit, None, None, **more)
