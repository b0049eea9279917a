"""Values over resolutions: sequence type, observed order, Richardson value, GCI band.

A sequence of values v(h) with h -> 0 is read as v = v0 + C h^p. Three levels give p, v0 and C
(Roache 1998; Celik et al., J. Fluids Eng. 130 (2008) 078001); more give a least squares fit
(Eça and Hoekstra, J. Comput. Phys. 262 (2014) 104). A band is claimed only where the sequence
supports it; everywhere else there is a refusal that says why, and no number.

    >>> found = study([0.4, 0.2, 0.1], [1.16, 1.04, 1.01])
    >>> found.sequence, round(found.order, 6), round(found.extrapolated, 6)
    ('monotone', 2.0, 1.0)
    >>> study([0.4, 0.2, 0.1], [1.0, 1.2, 1.1]).refused
    'oscillating: the change between neighbouring levels alternates in sign'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

SAFETY = 1.25  # Roache's factor for three or more levels
RATIOS = (1.3, 1.2)  # least ratio of neighbouring h: that of Celik et al., step 2, and what is taken without it
SETTLED = 1.5  # largest ratio of the orders of the finest three levels and of those before
ORDERS = (0.5, 4.5)  # plausible orders: see `study`
NOISE = 1e-8  # relative change below which a value no longer depends on h: solver tolerance
STEEPEST = 30.0  # orders are sought within +-STEEPEST


@dataclass(frozen=True)
class Band:
    """The interval [lower, upper] that a value is claimed to lie in, in the unit of the value."""

    lower: float
    upper: float

    def overlaps(self, other: Band) -> bool:
        """Whether the two bands share a value."""
        return self.lower <= other.upper and other.lower <= self.upper

    def contains(self, value: float) -> bool:
        """Whether the value lies in the band."""
        return self.lower <= value <= self.upper


@dataclass(frozen=True)
class Fit:
    """Least squares fit v = extrapolated + factor h^order; `scatter` is its standard deviation."""

    order: float
    extrapolated: float
    factor: float
    scatter: float


@dataclass(frozen=True)
class Convergence:
    """What a sequence of values says about its limit; each number is None where it is not allowed.

    sequence: "monotone", "oscillating", "diverging", "plateau", or None below three levels.
    order: observed order p, only for a monotone sequence. taken: the order that limit and band are
    drawn with, p or the highest that theory allows. extrapolated: Richardson value.
    gci: half width of the band around the finest value. refused: why the band is refused.
    used: indices (coarse to fine) of the three levels behind the numbers. fit: over all levels,
    where there are more than three and the fit exists. rest: the value of the undeformed body.
    """

    sequence: str | None
    order: float | None = None
    extrapolated: float | None = None
    gci: float | None = None
    refused: str | None = None
    used: tuple[int, ...] = ()
    fit: Fit | None = None
    value: float | None = None
    taken: float | None = None
    rest: float = 0.0

    @property
    def band(self) -> Band | None:
        """Finest value -+ gci, or None where it is refused."""
        return None if self.gci is None else Band(self.value - self.gci, self.value + self.gci)

    @property
    def gci_percent(self) -> float | None:
        """Half width of the band in percent of what the finest value is away from rest."""
        away = None if self.gci is None else abs(self.value - self.rest)
        return 100 * self.gci / away if away else None


def study(
    h: Sequence[float],
    values: Sequence[float | None],
    orders: tuple[float, float] = ORDERS,
    noise: float = NOISE,
    highest: float = np.inf,
    rest: float = 0.0,
) -> Convergence:
    """Convergence of `values` (None or not finite: a failed level) over element lengths `h`, in any order of levels.

    The numbers come from the finest level and the next two that are each at least 1.3 times coarser
    than the one before (1.2 where there are no such three); the sequence type is judged over all
    levels between them. A band needs an order within `orders`: below 0.5 the limit would lie more
    than 2.4 times the last change away (halved h), above 4.5 a change is smaller than any of our
    elements earns (the displacement of quadratic tetrahedra and of cubic Hermite plates converges
    with order 4 at most). With four levels or more it also needs the levels without the finest to
    show nearly the same order, else the sequence is not yet in its asymptotic range.
    `highest`: the order that theory allows in the limit, for example at a singular edge. A higher
    observed one is passing: it is reported, but limit and band are drawn with `highest` (Eça and
    Hoekstra do the same with the formal order).
    `rest`: the value of the undeformed body, from which changes are measured.
    Raises ValueError where lengths differ or an h is not positive or occurs twice.
    """
    h, known = _checked(h, values)
    said = Convergence(None, value=_last(known), rest=rest)
    if len(h) < 3:
        return replace(said, refused=f"fewer than three levels: {len(h)}")
    if not np.isfinite(known).all():
        failed = ", ".join(f"h = {x:.4g}" for x in h[~np.isfinite(known)])
        return replace(said, refused=f"failed level: {failed}")
    used = _spread(h)
    if len(used) < 3:
        reason = f"too little refinement: no three levels whose h differ by a factor of {RATIOS[-1]} each"
        return replace(said, refused=reason)
    sequence = sequence_type(h[used[0] :], known[used[0] :] - rest, noise)
    fit = least_squares(h, known) if len(h) > 3 else None
    found = replace(said, sequence=sequence, used=tuple(used), fit=fit)
    if sequence != "monotone":
        return replace(found, refused=REFUSED[sequence])
    order = observed_order(h[used], known[used])
    found = replace(found, order=order)
    if refused := _implausible(order, orders) or _unsettled(order, h[:-1], known[:-1], highest):
        return replace(found, refused=refused)
    taken = min(order, highest)
    limit = richardson(h[used[1:]], known[used[1:]], taken)
    return replace(found, taken=taken, extrapolated=limit, gci=SAFETY * abs(limit - float(known[-1])))


REFUSED = {
    "oscillating": "oscillating: the change between neighbouring levels alternates in sign",
    "diverging": "diverging: the change between neighbouring levels does not shrink as h^p with any p > 0",
    "plateau": "plateau: the last change is within the solver's tolerance, nothing is left to extrapolate",
}


def _implausible(order: float, orders: tuple[float, float]) -> str | None:
    low, high = orders
    return None if low <= order <= high else f"implausible order: {order:.3g} outside {low} to {high}"


def _unsettled(order: float, h: np.ndarray, values: np.ndarray, highest: float) -> str | None:
    """Why the levels before the finest contradict its order; None where they agree or are too few to tell.

    Orders above the highest that the limit allows count as that one.
    """
    before = _spread(h)
    if len(before) < 3:
        return None
    earlier = observed_order(h[before], values[before])
    if earlier is None:
        return f"unsettled order: the levels before the finest have none, with it {order:.3g}"
    low, high = sorted((min(order, highest), min(earlier, highest)))
    if high > SETTLED * low:
        return f"unsettled order: {earlier:.3g} before the finest level, {order:.3g} with it"
    return None


def observed_order(h: Sequence[float], values: Sequence[float]) -> float | None:
    """Order p > 0 of three levels (coarse to fine) with any refinement ratios; None where there is none.

    Solves (v3 - v2)/(v2 - v1) = (h3^p - h2^p)/(h2^p - h1^p) with 1 the finest. The right-hand side
    grows strictly with p, so the root is unique; it is the fixed point of Celik et al., Eq. (3), which
    the usual iteration can miss.
    """
    (h3, h2, h1), (v3, v2, v1) = h, values
    if v2 == v1 or (v3 - v2) / (v2 - v1) <= 0:
        return None
    wanted = np.log((v3 - v2) / (v2 - v1))

    def excess(p: float) -> float:
        if p == 0:
            return np.log(np.log(h3 / h2) / np.log(h2 / h1)) - wanted
        return p * np.log(h2 / h1) + np.log(np.expm1(p * np.log(h3 / h2)) / np.expm1(p * np.log(h2 / h1))) - wanted

    if excess(0.0) >= 0 or excess(STEEPEST) <= 0:
        return None
    return float(brentq(excess, 0.0, STEEPEST, xtol=1e-12))


def richardson(h: Sequence[float], values: Sequence[float], order: float) -> float:
    """Limit h -> 0 of two levels (coarse, fine) that converge with a known order."""
    return float(values[1] + (values[1] - values[0]) / ((h[0] / h[1]) ** order - 1))


def sequence_type(h: Sequence[float], values: Sequence[float], noise: float = NOISE) -> str:
    """Type of a sequence (coarse to fine, three levels or more).

    plateau: the last change is below `noise` times the largest value. oscillating: changes alternate
    in sign and shrink. diverging: they grow, or have one sign but no positive order fits the coarsest,
    a middle and the finest level. monotone: one sign and a positive order.
    """
    values, h = np.asarray(values, float), np.asarray(h, float)
    changes = np.diff(values)
    if abs(changes[-1]) <= noise * np.abs(values).max():
        return "plateau"
    if (changes[:-1] * changes[-1] < 0).any():
        return "oscillating" if abs(changes[-1]) < np.abs(changes[:-1]).max() else "diverging"
    used = _spread(h)
    used = used if len(used) == 3 else [0, len(h) // 2, len(h) - 1]
    return "monotone" if observed_order(h[used], values[used]) else "diverging"


def least_squares(h: Sequence[float], values: Sequence[float]) -> Fit | None:
    """Fit of v0 + C h^p over four levels or more; None where no order in [0.05, 12] is a minimum.

    v0 and C are linear once p is given, so only p is searched for (Eça and Hoekstra 2014, Eq. (10),
    without weights). `scatter` has n - 3 degrees of freedom.
    """
    h, values = np.asarray(h, float), np.asarray(values, float)
    if len(h) < 4:
        raise ValueError(f"a least squares fit of three numbers needs four levels, got {len(h)}")
    scaled = h / h.max()

    def solved(p: float) -> tuple[np.ndarray, float]:
        columns = np.stack([np.ones_like(h), scaled**p], axis=1)
        solution = np.linalg.lstsq(columns, values, rcond=None)[0]
        return solution, float(np.sum((columns @ solution - values) ** 2))

    low, high = 0.05, 12.0
    trial = np.linspace(low, high, 240)
    best = int(np.argmin([solved(p)[1] for p in trial]))
    if best in (0, len(trial) - 1):
        return None
    around = (trial[best - 1], trial[best + 1])
    p = float(minimize_scalar(lambda p: solved(p)[1], bounds=around, method="bounded", options={"xatol": 1e-10}).x)
    (limit, factor), square = solved(p)
    return Fit(p, float(limit), float(factor / h.max() ** p), float(np.sqrt(square / (len(h) - 3))))


def pairwise_orders(h: Sequence[float], errors: Sequence[float]) -> list[float | None]:
    """Orders between neighbouring levels of errors against a known value; None where an error is zero."""
    pairs = zip(h[:-1], h[1:], np.abs(errors[:-1]), np.abs(errors[1:]), strict=True)
    return [float(np.log(a / b) / np.log(x / y)) if a > 0 and b > 0 else None for x, y, a, b in pairs]


def _checked(h: Sequence[float], values: Sequence[float | None]) -> tuple[np.ndarray, np.ndarray]:
    """h and values as arrays sorted from coarse to fine; failed values become nan."""
    if len(h) != len(values):
        raise ValueError(f"{len(h)} element lengths but {len(values)} values")
    h = np.asarray(h, float)
    if not (h > 0).all() or len(np.unique(h)) != len(h):
        raise ValueError(f"element lengths must be positive and differ: {h.tolist()}")
    known = np.array([np.nan if value is None else value for value in values], float)
    order = np.argsort(-h)
    return h[order], known[order]


def _spread(h: np.ndarray) -> list[int]:
    """Indices (coarse to fine) of the finest level and the next two, each a ratio of RATIOS coarser."""
    for ratio in RATIOS:
        used = [len(h) - 1]
        for index in range(len(h) - 2, -1, -1):
            if len(used) < 3 and h[index] >= ratio * h[used[-1]] * (1 - 1e-9):
                used.append(index)
        if len(used) == 3:
            break
    return used[::-1]


def _last(values: np.ndarray) -> float | None:
    return float(values[-1]) if len(values) and np.isfinite(values[-1]) else None
