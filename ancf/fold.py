"""The points of an element on one side of its mirrors: all that an integral of even functions needs.

An element that is its own image along an axis (see `ancf.parity`) looks the same from both ends of it. A strain that is
even or odd there has E_pr = parity s_p s_r E_pr at the image of a point, with the signs s of the mirror, so that the
product of two strains of one parity is even, and of two parities nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ancf.element import FIELDS, Integrand
from ancf.parity import Mirrors

SAME = 1e-9  # of the largest value: what round-off leaves


def fold(parts: Integrand, mirrors: Mirrors) -> tuple[Integrand, np.ndarray | None]:
    """The integrand on one side of each mirror, with weights for both, and the parities (k,) of its enhanced strains.

    These are labels as in `ancf.parity.Split`. Where an enhanced strain is neither even nor odd, seen along the axes of
    space, the integrand stays whole and has no parities.
    """
    at = parts.at / np.abs(parts.at).max(axis=0)
    own, kept = np.lexsort(np.round(at, 9).T), np.arange(len(at))
    image, times, parities = np.empty_like(kept), np.ones(len(at)), np.zeros(parts.M.shape[-1], dtype=int)
    for axis in np.flatnonzero(mirrors):
        turn = np.where(np.arange(3) == axis, -1.0, 1.0)
        image[np.lexsort(np.round(at * turn, 9).T)] = own
        kept = kept[at[kept, axis] <= SAME]
        M, other = parts.M[kept], parts.M[image[kept]] * np.outer(turn, turn)[..., None]
        sign = np.sign(np.einsum("qprk,qprk->k", M, other))
        if np.abs(other - sign * M).max(initial=0.0) > SAME * np.abs(M).max(initial=0.0):
            return parts, None
        parities += (sign < 0) << axis
        times[at[:, axis] < -SAME] *= 2.0
    few = {name: getattr(parts, name)[kept] for name in FIELDS}
    return replace(parts, **few | {"volume": (times * parts.volume)[kept]}, columns=None), parities
