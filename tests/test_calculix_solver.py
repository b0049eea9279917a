"""CalculiX as a third solver of a scene: what it may be asked, and that it answers the same question."""

import numpy as np
import pytest

import reference_fe.run
import reference_fe.unpack
from compare.external import calculix
from compare.scene import ReferenceLevel, load
from compare.study import Entry
from reports import calculix_solver, third
from reports.bodies import bodies

PATCH = load("cantilever_plain_patch")
RUBBER = {"kind": "mooney-rivlin", "mu10": 3e5, "mu01": 0.0, "bulk_modulus": 1e7, "density": 2000.0}
GROUND = {"name": "ground", "shape": {"kind": "plane", "point": [0.0, 0.0, -9.0]}, "stiffness": 1e5}


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({}, None),
        ({"material": RUBBER, "surface_stress": False}, "Kirchhoff"),
        ({"obstacles": [GROUND]}, "touch nothing"),
        ({"initial": {"velocity": [0.0, 0.0, 1.0]}}, "at rest"),
        ({"supports": [{"kind": "symmetry", "edge": "x0", "normal": "X"}]}, "clamped"),
    ],
)
def test_it_is_asked_only_what_its_deck_says(changes, word):
    """Whatever the deck would leave out is refused, for it would be answered as if it were not there."""
    why = calculix_solver.why_not(PATCH.override(changes, "changed"))
    assert why is None if word is None else word in why


@pytest.mark.skipif(not calculix.available(), reason="no ccx on this machine")
def test_it_answers_the_same_question(monkeypatch):
    """With four integration points the reference is CalculiX's discretisation.

    Found: 2.2e-4 apart, for CalculiX ends its iterations at 0.5 % of the mean force; 1e-3 is asked for.
    """
    level, question = ReferenceLevel(size=0.5, time_step=0.02), PATCH.override({"analysis.until": 0.4}, "shorter")
    found = calculix_solver.solve(question, level)
    monkeypatch.setattr(reference_fe.unpack, "RULE_DEGREE", 2)
    other = reference_fe.run.solve(question, level)
    ours, theirs = (result.position(PATCH.probes[0].name)[-1, 2] for result in (other, found))
    assert ours < -1e-3 and theirs == pytest.approx(ours, rel=1e-3)
    assert found.times[-1] == pytest.approx(0.4) and found.unknowns == other.unknowns
    _same_body(found.outline, other.outline, found.times, other.times)
    entry = Entry(question, None, "calculix", level, found, found.status, "", 1.0, 1, True, "its key")
    (body,) = bodies([entry]).items
    assert (body.key, body.solver) == ("its key", "third") and "CalculiX h=0.5" in body.label
    (line,) = third.content([entry])["third"]
    assert line["run"] == body.key  # its row opens it


def _same_body(outline, other, times, their_times):
    """One surface; at the end, and on the way where both have the output, moved alike to 1e-3 of the largest."""
    np.testing.assert_array_equal(outline.points, other.points)
    np.testing.assert_array_equal(outline.triangles, other.triangles)
    size = np.abs(other.displacement).max()
    np.testing.assert_allclose(outline.displacement, other.displacement, atol=1e-3 * size)
    told = dict(zip(np.round(their_times[other.path_index], 6), other.path, strict=True))
    shared = [
        (own, told[t]) for t, own in zip(np.round(times[outline.path_index], 6), outline.path, strict=True) if t in told
    ]
    assert len(shared) >= 3
    for own, theirs in shared:
        np.testing.assert_allclose(own, theirs, atol=1e-3 * size)
