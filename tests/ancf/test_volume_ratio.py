"""det F at a point: that of a uniform deformation, and of a strip of rubber bent to an arc."""

import numpy as np
import pytest

from ancf.material import MooneyRivlin, from_engineering
from ancf.mesh import grid
from ancf.shape import FAMILY
from ancf.subdomain import element_rule
from ancf.system import body
from ancf.volume_ratio import volume_ratio

RUBBER = MooneyRivlin(2.5e6, 2.0e6, 1.33e8)
THICKNESS = 0.1


def plate(element, material, **more):
    mesh = grid(np.linspace(0, 0.4, 3), np.linspace(0, 0.2, 2), None, FAMILY[element])
    return body(mesh, (), THICKNESS, material, 1500.0, (5, 5, 3), **more)


def at(plate, point):
    mesh = plate.mesh
    rule = element_rule(mesh.cells[mesh.locate(*point[:2])], (), THICKNESS, (5, 5, 3))
    return volume_ratio(mesh, plate.elements, point, rule)


@pytest.mark.parametrize("volumetric", ["relaxed", "reduced", "full"])
def test_a_uniform_deformation_has_its_own_determinant(element, volumetric):
    """Its normal stress is one number, so that the relaxed thickness strain has nothing to do. No transverse shear,
    of which the enriched element's law sees 5/6."""
    A = np.array([[1.05, 0.1, 0.0], [0.0, 0.98, 0.0], [0.0, 0.0, 0.95]])
    own = plate(element, RUBBER, volumetric=volumetric)
    q = (own.mesh.vectors @ A.T).ravel()
    assert at(own, (0.3, 0.1, 0.05)).at(q) == pytest.approx(np.linalg.det(A), rel=1e-9)


@pytest.mark.parametrize("volumetric", ["relaxed", "full"])
def test_material_turned_inside_out_has_a_negative_ratio(element, volumetric):
    """The law sees C = F^T F alone, in which a reflection leaves no trace."""
    own = plate(element, RUBBER, volumetric=volumetric)
    q = (own.mesh.vectors * (-1.02, 1.0, 1.0)).ravel()
    assert at(own, (0.3, 0.1, 0.0)).at(q) < -0.9


def test_a_st_venant_kirchhoff_plate_has_det_f_of_its_position():
    own = plate("enriched", from_engineering(2e6, 0.3))
    assert at(own, (0.1, 0.1, 0.0)).at(1.1 * own.mesh.vectors.ravel()) == pytest.approx(1.331, rel=1e-12)


def test_a_bent_strip_keeps_its_volume_at_its_faces_where_the_thickness_strain_is_free():
    """Bent to the curvature c: F = 1 - c z of a straight director, 1 - (1 - 2 nu) / (1 - nu) c z of a solid.

    nu = (3 k - 2 G) / (6 k + 2 G) at rest; terms of the order c z are left out, 2.5 % of the difference from 1.
    """
    own = plate("enriched", RUBBER)
    mesh, c = own.mesh, 0.1
    q = mesh.vectors.copy()
    x = mesh.parameters[:, 0]
    arc = {
        "r": (np.sin(c * x) / c, mesh.parameters[:, 1], (1 - np.cos(c * x)) / c),
        "r_x": (np.cos(c * x), 0 * x, np.sin(c * x)),
        "r_z": (-np.sin(c * x), 0 * x, np.cos(c * x)),
    }
    for kind, places in arc.items():
        q[mesh.kinds == kind] = np.column_stack(places)[mesh.kinds == kind]
    G = 2 * (RUBBER.mu10 + RUBBER.mu01)
    nu = (3 * RUBBER.bulk - 2 * G) / (6 * RUBBER.bulk + 2 * G)
    for z in (-0.05, 0.05):
        ratio = at(own, (0.1, 0.1, z))
        assert np.linalg.det(q[ratio.vectors].T @ ratio.G) == pytest.approx(1 - c * z, abs=1e-4)
        assert (1 - ratio.at(q.ravel())) / (c * z) == pytest.approx((1 - 2 * nu) / (1 - nu), rel=0.1)
