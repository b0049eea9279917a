"""Plates that the tests of this folder share."""

from functools import partial

import numpy as np
import pytest

from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.nurbs import Surface
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, TOP, Band
from ancf.system import body

THICKNESS = 0.05
ROOT = np.sqrt(0.5)


def quarter_cylinder(radius=1.0, length=0.5):
    """Quarter of a cylinder about the x axis; its second parameter runs from 0 to 1 along the arc."""
    arc = radius * np.array([[-ROOT, ROOT], [0.0, 2 * ROOT], [ROOT, ROOT]])
    points = np.array([[[x, y, z] for y, z in arc] for x in (0.0, length)])
    return Surface((1, 2), ([0, 0, length, length], [0, 0, 0, 1, 1, 1]), points, [[1, ROOT, 1]] * 2)


X_GROOVE = Band(BOTTOM, GROOVE, 0, (0.2, 0.3), 0.03)
Y_GROOVE = Band(TOP, GROOVE, 1, (0.35, 0.5), 0.015)
FLAT = (np.array([0.0, 0.3, 0.7, 1.2]), np.array([0.0, 0.25, 0.6]))
CURVED = (np.linspace(0, 0.5, 2), np.linspace(0, 1, 4))
PLATES = {
    "plain": (FLAT, (), None),
    "grooved": (FLAT, (X_GROOVE, Y_GROOVE), None),
    "curved": (CURVED, (), quarter_cylinder()),
    "curved, grooved": (CURVED, (Band(BOTTOM, GROOVE, 0, (0.2, 0.45), 0.02),), quarter_cylinder()),
}


def _make(element, kind="plain", *, lines=None, bands=None, nu=0.3, points=(7, 7, 3), density=2000.0, **more):
    own_lines, own_bands, surface = PLATES[kind]
    mesh = grid(*(lines or own_lines), surface, FAMILY[element])
    material = from_engineering(2.0e6, nu)
    bands = own_bands if bands is None else bands
    return body(mesh, bands, THICKNESS, material, density, points, **more)


@pytest.fixture(params=list(FAMILY))
def element(request):
    """Name of a member of the element family."""
    return request.param


@pytest.fixture
def make_body(element):
    """Body of a kind of PLATES (unequal elements), E = 2 MPa, 2000 kg/m3, 0.05 m thick; details as keywords."""
    return partial(_make, element)


@pytest.fixture(params=list(PLATES))
def plate(request, make_body):
    """One body of each kind."""
    return make_body(request.param)


@pytest.fixture
def deformed():
    """Nodal vectors (v, 3) of a body: large rotation, and a few per cent of strain."""

    def deform(plate, seed=0, amount=0.03):
        rng = np.random.default_rng(seed)
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        vectors = plate.mesh.vectors
        return vectors @ (turn * np.sign(np.linalg.det(turn))).T + amount * rng.standard_normal(vectors.shape)

    return deform
