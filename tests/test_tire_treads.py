"""Treads around the tire: only what lies on the surface is cut, and both solvers cut as much."""

import pytest

from compare.report import Page, render
from compare.scene import load
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import standing, treads
from reports.unit import Measured


def test_a_tread_between_the_shoulders_leaves_the_sidewalls_alone():
    """The half of it beyond the plane of symmetry is dropped, a groove on that plane is cut there."""
    scene = load(standing.SCENE).override(treads.stated("block"))
    highest = max(band.limits(1)[1] if hasattr(band, "limits") else band.edges[1] for band in scene.grooves)
    assert highest < treads.CROWN + 0.1
    rib = load(standing.SCENE).override(treads.stated("rib"))
    edges = [band.edges for band in rib.grooves]
    assert edges == [pytest.approx((0.051, 0.0935)), pytest.approx((0.1955, 0.238))]  # four of 0.0425 on 0.68
    changes = treads.stated("rib")
    changes["tread"] |= {"ribs": 6}  # five grooves, the middle one on the plane of symmetry
    changes["probes.1.at"] = [3.141592653589793, 0.05, 0.06]
    assert load(standing.SCENE).override(changes).grooves[0].edges[0] == 0.0


@pytest.mark.parametrize("kind", ["rib", pytest.param("traction", marks=pytest.mark.slow)])
def test_both_solvers_cut_as_much_from_the_tire(kind):
    found = treads.wrapped(kind)
    assert found["differ"] < treads.BAR
    assert found["shapes"] == treads.MESH[1]  # one pitch of the tread for each element around: one shape in a row


def test_the_section_shows_volumes_and_footprints():
    values = {"grooves": 2, "plate_taken": 0.1, "solid_taken": 0.1, "differ": 0.5, "elements": 48, "shapes": 4}
    cut = Outcome(Asked(treads.RUN, {"kind": "rib"}), Measured("u", {}, "ok", values))
    told = {"kind": "rib", "mesh": [12, 4]}
    prints = {"radius": 1.26, "footprint": 0.3, "x": [0.0, 0.1], "y": [0.0, 0.1], "traction": [1e5, 0.0]}
    stood = Outcome(Asked(treads.STAND, told), Measured("u", told, "ok", prints))
    (figure,) = treads.figures([cut, stood])
    assert figure.value == 0.5 and figure.met
    assert "Footprint of the rib tread" in render(Page("t", "l", [treads.section([cut, stood])], "f"))
