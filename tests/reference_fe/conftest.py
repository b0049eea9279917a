"""Small solids for the tests of the reference."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from reference_fe.elasticity import lame, pattern, scalar_mass, tabulate
from reference_fe.geometry import Band, Plate
from reference_fe.loads import load_at
from reference_fe.mesh import Solid, Spacing, make
from reference_fe.surface import Frame, Surface, lengths
from reference_fe.system import System, assemble

sys.path.insert(0, str(Path(__file__).parent))  # for plate_scene

GROOVED = Plate(1.0, 0.8, 0.1, grooves=(Band(-1, 0, (0.3, 0.5), (0.0, 1.0), 0.06),))


def quarter_cylinder(radius: float, length: float) -> Surface:
    """Exact quarter cylinder about X: x along it in metres, y from 0 to 1 around it, normal outward."""
    w, side = 2**-0.5, radius * 2**0.5
    arc = np.array([[-w * radius, w * radius], [0.0, side], [w * radius, w * radius]])
    points = np.array([[(x, *place) for place in arc] for x in (0.0, length)])
    knots = (np.array([0, 0, length, length]), np.array([0, 0, 0, 1, 1, 1]))
    plain = Surface((1, 2), knots, points, np.array([[1, w, 1]] * 2))
    return Surface((1, 2), knots, points, plain.weights, Frame((0.0, 0.0), lengths(plain)))


@cache
def solid_of(plate: Plate, size: float) -> Solid:
    """Uniform mesh of a flat plate."""
    return make(plate, Spacing(size))


@cache
def curved_solid(size: float, radius: float = 1.0, length: float = 0.4, thickness: float = 0.2) -> Solid:
    """Quarter cylinder of this mean radius, length and thickness (m)."""
    surface = quarter_cylinder(radius, length)
    around = surface.frame.interval(1, (0.0, 1.0))[1]
    return make(Plate(length, around, thickness), Spacing(size), surface)


def system_of(
    solid: Solid, held=None, loads=(), young: float = 1e6, poisson: float = 0.3, density: float = 1000.0
) -> System:
    """The solid as a System; `held` is a mask (n,) of fixed nodes."""
    count = solid.places.shape[1]
    held = np.zeros(count, dtype=bool) if held is None else held
    table, mass = tabulate(solid, 4), scalar_mass(solid, density)
    where = pattern(table.nodes, held)
    return assemble(table, lame(young, poisson), where, mass, load_at(tuple(loads), (count, 3)), 1e-6)


@pytest.fixture(scope="session")
def build():
    """The builders above, by name."""
    from types import SimpleNamespace

    return SimpleNamespace(
        grooved=GROOVED,
        solid=solid_of,
        curved=curved_solid,
        system=system_of,
        cylinder=quarter_cylinder,
    )
