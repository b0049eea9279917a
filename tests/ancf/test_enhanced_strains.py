"""What the enhanced strains of the enriched element are for."""

import numpy as np
import pytest

from ancf.material import from_engineering
from ancf.mesh import grid
from ancf.shape import FAMILY, Plate
from ancf.subdomain import BOTTOM, GROOVE, Band
from ancf.system import body, system

E, THICKNESS = 2.0e6, 0.05


def torsion_constant(width, height):
    """J of a rectangle (Saint-Venant): b h^3 / 3 (1 - 192 h / (pi^5 b) sum over odd n of tanh(n pi b / 2 h) / n^5)."""
    n = np.arange(1, 40, 2)
    series = np.sum(np.tanh(n * np.pi * width / (2 * height)) / n**5)
    return width * height**3 / 3 * (1 - 192 * height / (np.pi**5 * width) * series)


def twist_stiffness(shape, width, bands=()):
    """J of a strip from its energy at w = x y with the director (d_x, -x): d_x and all of u and v are free."""
    half = width / 2 * np.sin(np.linspace(-1, 1, 13) * np.pi / 2)  # narrow elements at the free edges
    material = from_engineering(E, 0.3)
    mesh = grid(np.array([0.0, 0.1]), half, shape=shape)
    plate = body(mesh, bands, THICKNESS, material, 1.0, (7, 7, 3))
    x, y = mesh.parameters.T
    u, kinds = np.zeros(mesh.vectors.shape), mesh.kinds
    u[kinds == "r", 2] = (x * y)[kinds == "r"]
    u[kinds == "r_x", 2], u[kinds == "r_y", 2], u[kinds == "r_xy", 2] = y[kinds == "r_x"], x[kinds == "r_y"], 1.0
    u[kinds == "r_z", 1] = -x[kinds == "r_z"]
    held = np.ones(u.shape, dtype=bool)
    held[:, 0] = False
    held[~np.isin(kinds, ["r_z", "d_e"]), 1] = False
    acting = system(plate, np.zeros(u.size, dtype=bool), (), THICKNESS)
    K = acting.assembly.pattern.full(acting.tangent(mesh.vectors.ravel())).toarray()
    u, free = u.ravel(), ~held.ravel()
    u[free] = np.linalg.lstsq(K[np.ix_(free, free)], -K[np.ix_(free, ~free)] @ u[~free])[0]
    return u @ K @ u / (material.shear * 0.1)


@pytest.mark.parametrize("ratio", [4, 10])
def test_a_strip_twists_like_a_solid(ratio):
    """The layer at free edges where the twist fades out: Reissner's plate has 0.632 h/b, the solid 0.630 h/b.

    With a director that stays straight it is 0.577 h/b, which the element without enhanced shear shows.
    """
    exact = torsion_constant(ratio * THICKNESS, THICKNESS)
    assert twist_stiffness(FAMILY["enriched"], ratio * THICKNESS) == pytest.approx(exact, rel=1e-3)
    straight = ratio * THICKNESS**4 / 3 * (1 - 0.577 / ratio)
    assert twist_stiffness(Plate("straight", twist=True, edges=True), ratio * THICKNESS) == pytest.approx(
        straight, rel=1e-3
    )


def test_warping_follows_the_thickness_that_is_left():
    """A groove over the whole strip leaves a thinner one, off its middle: the same layer, of its own thickness."""
    groove = Band(BOTTOM, GROOVE, 0, (-1.0, 1.0), 0.02)
    found = twist_stiffness(FAMILY["enriched"], 0.3, (groove,))
    assert found == pytest.approx(torsion_constant(0.3, THICKNESS - 0.02), rel=1e-3)
