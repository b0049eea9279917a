"""The solid that OCC cuts has the volume that geometry gives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from reference_fe.geometry import Band, Curve, MeshError, Plate, build, session

PLATE = Plate(1.0, 0.8, 0.1)
WHOLE = 1.0 * 0.8 * 0.1


def volume(plate: Plate) -> float:
    with session() as gmsh:
        return build(gmsh, plate)


def arc_section(left: float, radius: float, floor: float) -> Curve:
    """A groove with quarter-circle walls of this radius and a flat floor; its area is exact below."""
    right, w = left + 2 * radius + floor, 2**-0.5
    points = [(left, 0), (left, radius), (left + radius, radius), (left + radius + floor / 2, radius)]
    points += [(right - radius, radius), (right, radius), (right, 0)]
    return Curve(2, np.array(points), np.array([1, w, 1, 1, 1, w, 1]), np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 3]))


@pytest.mark.parametrize(
    ("bands", "removed"),
    [
        ((), 0.0),
        ((Band(-1, 0, (0.3, 0.5), (0.0, 1.0), 0.06),), 0.2 * 0.06),
        ((Band(1, 1, (0.3, 0.5), (0.0, 0.8), 0.06),), 0.2 * 0.8 * 0.06),
        ((Band(1, 0, (0.3, 0.5), (0.25, 0.75), 0.06),), 0.2 * 0.5 * 0.06),
        ((Band(-1, 0, (0.0, 0.2), (0.0, 1.0), 0.06),), 0.2 * 0.06),
        ((Band(-1, 0, (0.1, 0.2), (0.0, 1.0), 0.06), Band(1, 0, (0.5, 0.7), (0.0, 1.0), 0.02)), 0.006 + 0.004),
        ((Band(-1, 0, (0.1, 0.2), (0.0, 1.0), 0.05), Band(-1, 1, (0.4, 0.6), (0.0, 0.8), 0.05)), 0.005 + 0.008 - 0.001),
    ],
    ids=["none", "bottom along x", "top along y", "extent", "at the edge", "both faces", "crossing"],
)
def test_grooved_volume_is_the_closed_form(bands, removed):
    assert math.isclose(volume(replace(PLATE, grooves=bands)), WHOLE - removed, rel_tol=1e-12)


def test_a_nurbs_section_with_circular_walls_removes_its_exact_area():
    section = arc_section(0.3, 0.05, 0.1)
    plate = replace(PLATE, grooves=(Band(-1, 0, (0.3, 0.5), (0.0, 1.0), section),))
    removed = 0.1 * 0.05 + 2 * math.pi / 4 * 0.05**2
    assert math.isclose(volume(plate), WHOLE - removed, rel_tol=1e-9)  # OCC integrates curved faces to about 1e-10


@pytest.mark.parametrize("section", [0.06, arc_section(0.3, 0.05, 0.1)], ids=["rectangular", "round"])
def test_a_protrusion_adds_what_a_groove_removes(section):
    band = Band(1, 0, (0.3, 0.5), (0.0, 1.0), section)
    kept = volume(replace(PLATE, grooves=(band,)))
    grown = volume(replace(PLATE, protrusions=(band,)))
    assert math.isclose(kept + grown, 2 * WHOLE, rel_tol=1e-9)


def test_kept_plus_removed_is_the_whole():
    band = Band(-1, 0, (0.3, 0.5), (0.0, 1.0), 0.06)
    removed = volume(Plate(1.0, 0.2, 0.06))
    assert math.isclose(volume(replace(PLATE, grooves=(band,))) + removed, WHOLE, rel_tol=1e-12)


def test_imprinting_changes_no_volume():
    band = Band(-1, 0, (0.3, 0.5), (0.0, 1.0), 0.06)
    plate = replace(PLATE, grooves=(band,), regions=(((0.4, 1.0), (0.2, 0.8)),), lines=((0.5, 0.4), (1.0, 0.8)))
    assert math.isclose(volume(plate), WHOLE - 0.2 * 0.06, rel_tol=1e-12)


def test_a_groove_through_the_plate_is_a_named_failure():
    plate = replace(PLATE, grooves=(Band(-1, 0, (0.3, 0.5), (0.0, 1.0), 0.2),))
    with pytest.raises(MeshError, match="2 separate bodies") as failure:
        volume(plate)
    assert failure.value.status == "geometry_failed"


def test_a_session_leaves_gmsh_closed_even_after_a_failure():
    import gmsh

    with pytest.raises(ZeroDivisionError), session():
        raise ZeroDivisionError
    assert not gmsh.isInitialized()
