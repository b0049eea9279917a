"""Held displacement components (n, 3) of the nodes of a solid; places are in the coordinates of the box (m)."""

from __future__ import annotations

import numpy as np

from reference_fe.geometry import MeshError
from reference_fe.mesh import Solid


def held(solid: Solid, place: tuple[tuple[int, float], ...], components: tuple[int, ...]) -> np.ndarray:
    """Components held at all nodes whose box coordinates have the values of `place`, pairs (axis, value).

    Raises MeshError "support_misses" where no node lies there: its place may have been cut away.
    """
    there = np.ones(solid.places.shape[1], dtype=bool)
    for axis, value in place:
        there &= np.abs(solid.places[axis] - value) < 1e-7 * solid.extent
    if not there.any():
        named = ", ".join(f"{'xyz'[axis]} = {value:g} m" for axis, value in place)
        raise MeshError("support_misses", f"no material at {named} to hold")
    mask = np.zeros((there.size, 3), dtype=bool)
    mask[np.ix_(there, components)] = True
    return mask
