"""A groove or a protrusion that is a straight band along a side of the plate, and its section."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ancf.nurbs import Curve, curve_derivatives, invert
from ancf.quadrature import NO_PROMISE, Rule, gauss, onto_cell

BOTTOM, TOP = -1, 1
GROOVE, PROTRUSION = -1, 1

Interval = tuple[float, float]
Cell = tuple[Interval, Interval]


@dataclass(frozen=True)
class Band:
    """A groove or a protrusion: a straight band on one face, running along an axis.

    face: BOTTOM or TOP. sign: GROOVE or PROTRUSION. along: the axis it runs along. edges: its two
    edges on the other axis. extent: its two ends on its own axis. section: the depth (height) in m
    where it is constant, or a curve through (across, depth), measured from the plate's plain face,
    whose first component does not decrease.
    """

    face: int
    sign: int
    along: int
    edges: Interval
    section: float | Curve
    extent: Interval = (-np.inf, np.inf)

    @property
    def across(self) -> int:
        """The axis that crosses the band."""
        return 1 - self.along

    @property
    def is_curved(self) -> bool:
        """Whether the section is a curve."""
        return isinstance(self.section, Curve)

    def limits(self, axis: int) -> Interval:
        """First and last coordinate of the band on an axis."""
        return self.edges if axis == self.across else self.extent


def along_curve(curve: Curve, low: float, high: float, count: int, tolerance: float) -> tuple[Rule, np.ndarray]:
    """Rule in the coordinate across a section, and the depth (q,) there, from Gauss points in the curve's parameter.

    Between low and high the section is smooth. The weights y'(u) du are scaled so that they add up
    to the interval's length at any `count`: the plain part of the plate keeps its volume exactly.
    """
    breaks = curve.breaks
    at_breaks = curve_derivatives(curve, breaks)[0][:, 0]
    first = breaks[np.abs(at_breaks - low) <= tolerance]
    last = breaks[np.abs(at_breaks - high) <= tolerance]
    start = first.max() if first.size else float(invert(curve, low))
    end = last.min() if last.size else float(invert(curve, high))
    along = onto_cell(gauss(count), [(start, end)])
    c, c_u, _ = curve_derivatives(curve, along.points[:, 0])
    weights = along.weights * c_u[:, 0]
    return Rule(c[:, :1], weights * ((high - low) / weights.sum()), NO_PROMISE), c[:, 1]


def evenness(rule: Rule) -> float:
    """Least over greatest slope of the map from Gauss points: small where the section has a vertical tangent."""
    slope = rule.weights / gauss(len(rule.weights)).weights
    return slope.min() / slope.max()


def section_depth(band: Band, across: np.ndarray) -> np.ndarray:
    """Depth (m) of a band's section at coordinates across it, clipped to its edges."""
    if not band.is_curved:
        return np.full(np.shape(across), float(band.section))
    return curve_derivatives(band.section, invert(band.section, across))[0][..., 1]


@lru_cache(maxsize=256)
def section_shape(section: float | Curve) -> tuple:
    """What makes two sections the same wherever they lie, to 11 digits."""
    if not isinstance(section, Curve):
        return (section,)
    numbers = [section.knots, section.weights, section.control_points - [section.control_points[0, 0], 0.0]]
    return section.degree, *(float(f"{value:.10e}") for array in numbers for value in array.ravel())
