"""A closed, grooved ring has one volume and one lowest frequency, whichever solver is asked."""

import pytest

from ancf import run as ancf
from reference_fe import run as reference
from tests.revolved_scenes import arc, first, scene_of


def test_both_solvers_hold_the_same_ring():
    """Volumes to 2e-4, that of 16 x 6 cubic elements; the lowest frequency to the 1 % that the meshes lack."""
    groove = {"name": "round", "face": "top", "along": "x", "across": [0.3, 0.6], "depth": 0.05}
    scene = scene_of(
        arc(), grooves=[groove], ancf={"levels": [{"mesh": [16, 6]}]}, reference={"levels": [{"size": 0.2}]}
    )
    plate, solid = ancf.solve(scene, first(scene, "ancf")), reference.solve(scene, first(scene, "reference"))
    assert plate.facts["volume"] == pytest.approx(solid.facts["exact_volume"], rel=3e-4)
    assert plate.facts["rigid_modes"] == solid.facts["rigid_modes"] == 6
    assert plate.frequencies[0] == pytest.approx(solid.frequencies[0], rel=0.01)
