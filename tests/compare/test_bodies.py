"""Bodies of a page: what is packed is what was drawn, and a path is thinned evenly."""

import json
from dataclasses import replace

import numpy as np
import pytest
import synthetic_study

from compare import bodies
from compare.result import MOST, Contact, Shots, load, save
from compare.scene import load as scene_of
from compare.study import run
from reports.bodies import ALLOWED, _apart, _contact, _fields
from reports.bodies import bodies as packed


def test_a_packed_body_is_the_outline_to_a_65000th():
    """Every corner of every triangle, rest and displaced, within half a unit of the packing."""
    outline = synthetic_study.body(6, -0.5)
    shapes = np.stack([0.5 * outline.displacement, outline.displacement])
    points, moved, triangles, edges = bodies.unpack(*bodies.pack(outline, ["half", "all"], shapes))
    wanted = np.sort(outline.points[outline.triangles].reshape(len(outline.triangles), -1), axis=0)
    found = np.sort(points[triangles].reshape(len(triangles), -1), axis=0)
    np.testing.assert_allclose(found, wanted, atol=0.5 / bodies.LEVELS)
    corner = np.argmin(np.linalg.norm(points - points.max(axis=0), axis=1))
    np.testing.assert_allclose(moved[:, corner, 2], [-0.25, -0.5], atol=1e-4)
    assert len(edges) > 0 and edges.max() < len(points)


def test_a_field_is_packed_beside_the_displacement_and_keeps_points_apart():
    """Its greatest value is told; corners that coincide but differ in it stay two."""
    outline = synthetic_study.body(2, -0.5)
    pressure = np.linspace(0, 3e5, len(outline.points))
    header, data = bodies.pack(outline, ["t"], outline.displacement[None], {"contact pressure (Pa)": pressure})
    about = json.loads(header)
    assert about["fields"] == [{"name": "contact pressure (Pa)", "unit": 3e5 / bodies.LEVELS, "greatest": 3e5}]
    points, _, triangles, _ = bodies.unpack(header, data)
    assert about["points"] == len(outline.points) == len(points) and len(triangles) == len(outline.triangles)


def test_contact_is_drawn_where_it_presses():
    """Pressure at one contact point of the bottom face colours the nodes beside it and no others."""
    entry = next(e for e in synthetic_study.entries("quick") if e.scene.name == "cantilever" and e.solver == "ancf")
    points = np.array([[x, 0.0, -0.025] for x in np.linspace(0, 1, 9)])
    contact = Contact(np.zeros((1, 1, 3)), np.zeros((1, 1)), points, np.full(9, 0.01), np.array([5.0, *8 * [-1.0]]))
    pressed = _contact(replace(entry, result=replace(entry.result, contact=contact)))[
        "contact pressure at the end (Pa)"
    ]
    outline = entry.result.outline
    assert pressed.max() == 5.0 and pressed.min() == 0.0
    assert (np.linalg.norm(outline.points[pressed > 0] - points[0], axis=1) <= 0.125 + 1e-9).all()
    twice = Contact(
        *(np.zeros((1, 2, 3)), np.zeros((1, 2)), np.tile(points, (2, 1)), np.full(18, 0.01)),
        np.array([0.0] * 9 + [5.0, *8 * [-1.0]]),
    )
    again = _contact(replace(entry, result=replace(entry.result, contact=twice)))["contact pressure at the end (Pa)"]
    np.testing.assert_array_equal(again, pressed)  # a second obstacle over the same face


def test_a_body_is_coloured_by_its_distance_from_the_reference():
    """Exact for displacements that are linear on another mesh's triangles; none for another shape, nor for modes."""
    fine, coarse = synthetic_study.body(8, 0.0), synthetic_study.body(3, 0.0)
    bent = [replace(body, displacement=body.points @ np.diag([0.1, 0.2, 0.3])) for body in (fine, coarse)]
    moved = replace(bent[0], displacement=bent[0].displacement + np.array([0.0, 0.03, 0.04]))
    np.testing.assert_allclose(_apart(moved, bent[1]), 0.05, rtol=1e-9)
    np.testing.assert_allclose(_apart(bent[0], bent[1]), 0.0, atol=1e-12)
    assert _apart(fine, replace(coarse, points=coarse.points + np.array([0.0, 0.05, 0.0]))) is None
    assert _apart(fine, replace(coarse, modes=coarse.points[None])) is None


def test_every_body_but_the_reference_itself_has_an_error_and_stress_is_shown_where_it_is_told():
    entries = [e for e in synthetic_study.entries("quick") if e.scene.name == "cantilever"]
    reference = next(e for e in reversed(entries) if e.solver == "reference")
    (name,) = _fields(entries[0], reference)
    assert name.startswith("distance from the reference h=") and _fields(reference, reference) == {}
    outline = replace(entries[0].result.outline, stress=np.full(len(entries[0].result.outline.points), 7.0))
    told = _fields(replace(entries[0], result=replace(entries[0].result, outline=outline)), reference)
    assert set(told.pop("von Mises stress at the end (Pa)")) == {7.0} and list(told) == [name]


def test_points_that_coincide_are_one_and_cracks_stay():
    """Two triangles with corners of their own share an edge where they move alike, and none where they do not."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], float)
    outline = replace(synthetic_study.body(1, 0.0), points=points, triangles=np.array([[0, 1, 2], [3, 5, 4]]),
                      edges=np.empty((0, 2), int))  # fmt: skip
    whole = bodies.unpack(*bodies.pack(outline, ["t"], np.zeros((1, 6, 3))))[0]
    apart = np.zeros((1, 6, 3))
    apart[0, 3:, 2] = 0.1
    assert (len(whole), len(bodies.unpack(*bodies.pack(outline, ["t"], apart))[0])) == (4, 6)


@pytest.mark.parametrize("outputs", [1, 2, 9, 10, 51, 1000])
def test_shots_are_even_and_few(outputs):
    """Between MOST / 2 and MOST of them where there are so many outputs, all at one distance, rest left out."""
    shots = Shots()
    for output in range(outputs):
        shots.take(output, np.array([output]))
    assert [int(state[0]) for state in shots.states] == shots.index
    assert len(shots.index) <= MOST and (outputs < 10 or len(shots.index) >= MOST // 2)
    assert len(set(np.diff([0, *shots.index]))) <= 1


def test_both_solvers_write_the_way_down(tmp_path):
    """The path's outputs move the probe as the history says: P of the plate is a corner of the surface."""
    changes = {
        "ancf.levels": [{"element": "conforming", "mesh": [2, 2], "points": [3, 3, 2], "time_step": 0.02}],
        "reference.levels": [{"size": 0.5, "time_step": 0.02}],
    }
    scene = scene_of("cantilever_plain").override({**changes, "sensitivity": None})
    solvers = {"ancf": "ancf.run", "reference": "reference_fe.run"}
    for entry in run([scene], solvers, "standard", tmp_path):
        result, outline = entry.result, entry.result.outline
        assert 4 <= len(outline.path) <= MOST
        high = result.displacement[outline.path_index, 0, 2]
        corner = np.argmin(np.linalg.norm(outline.points - [1.0, 1.0, 0.0], axis=1))
        close = 0.02 if np.linalg.norm(outline.points[corner] - [1.0, 1.0, 0.0]) > 1e-9 else 1e-6
        np.testing.assert_allclose(outline.path[:, corner, 2], high, atol=close)
        again = tmp_path / "again.npz"
        save(result, again)
        np.testing.assert_array_equal(load(again).outline.path, outline.path)


def test_a_page_carries_no_more_than_it_may(monkeypatch):
    """Finest levels come first; what has no room is counted."""
    entries = [e for e in synthetic_study.entries("quick") if e.scene.name == "cantilever"]
    whole = packed(entries)
    assert sum(body.size for body in whole.items) < ALLOWED and whole.left_out == ""
    monkeypatch.setattr("reports.bodies.ALLOWED", whole.items[0].size + 10)
    cut = packed(entries)
    assert len(cut.items) < len(whole.items) and "left out" in cut.left_out
    assert cut.items[0].key == whole.items[0].key
