"""Closed forms against printed tables and limits."""

import csv
from pathlib import Path

import numpy as np
import pytest

from compare.exact import (
    annulus_deflection,
    beam_deflection,
    beam_frequency,
    cross_code,
    elastica_end_moment,
    elastica_end_shear,
    published,
    reentrant_order,
)
from compare.scene import load

DATA = Path(__file__).parent / "data"


def rows(name):
    with (DATA / name).open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


@pytest.mark.parametrize("row", rows("elastica_end_shear.csv"), ids=lambda row: f"{row['alpha_PL2_over_EI']:g}")
def test_end_shear_equals_the_tabulated_elastica(row):
    deflection, shortening, angle = elastica_end_shear(row["alpha_PL2_over_EI"])
    assert deflection == pytest.approx(row["w_over_L"], abs=1e-10)  # the table has ten digits
    assert shortening == pytest.approx(row["u_over_L"], abs=1e-10)
    assert angle == pytest.approx(row["theta_tip_rad"], abs=1e-9)


@pytest.mark.parametrize("row", rows("sze_end_shear.csv"), ids=lambda row: f"{row['P_over_Pmax']:g}")
def test_end_shear_lies_near_the_shells_of_sze(row):
    deflection, shortening, _ = elastica_end_shear(row["P_over_Pmax"] * 4 * 10**2 / 100)
    for known, printed in ((10 * deflection, row["W_tip"]), (10 * shortening, row["minus_U_tip"])):
        assert abs(known - printed) < 5e-4 + 2e-3 * known  # half a printed digit, and S4R on 16 elements


@pytest.mark.parametrize("row", rows("elastica_end_moment.csv"), ids=lambda row: f"{row['M_over_Mmax']:g}")
def test_end_moment_equals_the_printed_exact_column(row):
    deflection, shortening, _ = elastica_end_moment(2 * np.pi * row["M_over_Mmax"])
    assert 12 * deflection == pytest.approx(row["W_exact"], abs=6e-4)  # printed with three digits
    assert 12 * shortening == pytest.approx(row["minus_U_exact"], abs=6e-4)


def test_small_end_shear_is_the_linear_beam():
    deflection, _, angle = elastica_end_shear(1e-4)
    assert deflection == pytest.approx(1e-4 / 3, rel=1e-6)
    assert angle == pytest.approx(1e-4 / 2, rel=1e-6)
    # a force P on L = b = 1, EI = E t^3 / 12 has load parameter P / EI
    assert beam_deflection(1e-4 * 2e6 * 0.05**3 / 12, 1, 1, 0.05, 2e6) == pytest.approx(1e-4 / 3, rel=1e-12)


def test_the_elastica_is_inextensible_and_cannot_deflect_beyond_its_length():
    deflection, shortening, angle = elastica_end_shear(200.0)
    assert deflection < 1
    assert 0 < shortening < 1
    assert angle < np.pi / 2
    with pytest.raises(ValueError, match="positive"):
        elastica_end_shear(0.0)


def test_frequencies_of_the_clamped_beam():
    roots = (1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349)  # Blevins, table 8-1
    for mode, root in enumerate(roots, 1):
        expected = root**2 / (2 * np.pi) * 0.05 * np.sqrt(2e6 / (12 * 2000))
        assert beam_frequency(mode, 1.0, 0.05, 2e6, 2000.0) == pytest.approx(expected, rel=1e-9)


def test_published_values_name_their_cell_and_source():
    found = published(load("cantilever"))
    assert [(value.mesh, value.value) for value in found][:2] == [((2, 2), -0.4098), ((3, 3), -0.4649)]
    assert found[-1].mesh is None
    assert found[-1].value == -0.5669
    assert all(value.kind == "published" and value.cell and "Table 5" in value.source for value in found)


def test_cross_code_values_belong_to_the_very_question_only():
    plain, grooved = load("cantilever_plain"), load("cantilever")
    assert -0.50061 in [value.value for value in cross_code(plain)]
    assert -0.56526 in [value.value for value in cross_code(grooved)]
    assert cross_code(load("cantilever_patch")) == ()


OTHER_QUESTIONS = {
    "grooves.0.depth": 0.029,
    "grooves.0.face": "top",
    "grooves": [],
    "thickness": 0.06,
    "surface.length": 1.1,
    "material.youngs_modulus": 2.1e6,
    "material.poissons_ratio": 0.1,
    "supports.0.edge": "y0",
    "loads.0.force": [0.0, 0.0, -49.0],
    "loads.0.at": [1.0, 0.9],
    "loads.0.history": [[0.0, 0.0], [0.5, 1.0]],
    "initial": {"velocity": [0.0, 0.0, 1.0]},
    "analysis.until": 2.0,
    "probes.0.at": [1.0, 1.0, 0.01],
}


@pytest.mark.parametrize("key", OTHER_QUESTIONS)
def test_cross_code_values_do_not_answer_another_question(key):
    stated = load("cantilever").override({"sensitivity": None})
    asked = stated.override({key: OTHER_QUESTIONS[key]})
    assert cross_code(stated)
    assert not {value.value for value in cross_code(asked)} & {value.value for value in cross_code(stated)}


def test_the_order_at_a_reentrant_edge_is_that_of_the_known_corners():
    """A crack has 2 lambda = 1; the L-shaped corner lambda = 0.544484 (Williams 1952); a flat edge 2."""
    assert reentrant_order(2 * np.pi) == pytest.approx(1.0, abs=1e-9)
    assert reentrant_order(1.5 * np.pi) / 2 == pytest.approx(0.544484, abs=1e-6)
    assert reentrant_order(1.001 * np.pi) == pytest.approx(2.0, abs=0.02)
    with pytest.raises(ValueError, match="re-entrant"):
        reentrant_order(0.5 * np.pi)


@pytest.mark.parametrize(("clamped", "disc"), [(True, 1 / 64), (False, 5.3 / (64 * 1.3))])
def test_an_annulus_with_a_tiny_hole_bends_like_the_disc(clamped, disc):
    assert annulus_deflection(1e-4, 0.3, clamped) == pytest.approx(disc, rel=1e-6)


def test_the_deflection_of_an_annulus_meets_its_equation_of_virtual_work():
    """A narrow ring, free inside and supported outside, is a ring beam turned by p (a - b) at the arm (a - b) / 2.

    With c = (a - b) / a small the turning moment per length of the ring is p c^2 / 2 (R = 1), its stiffness against
    turning E t^3 c / 12 = D (1 - nu^2) c, so w / c = p c^2 / 2 / (D (1 - nu^2) c).
    """
    c, nu = 1e-3, 0.3
    expected = c**2 / (2 * (1 - nu**2))
    assert annulus_deflection(1 - c, nu, False) == pytest.approx(expected, rel=3 * c)
