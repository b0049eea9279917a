"""The chapter of plates and shells: its surfaces are what they say, its verdicts those of its table."""

import math

import numpy as np
import pytest

from ancf.nurbs import Surface, surface_derivatives
from reports.hard_cases import shell_cases, shell_scenes, shell_surfaces, shells
from reports.hard_cases.chapter import Outcome
from reports.unit import Measured

U = np.linspace(0.0, 1.0, 101)


def points(words, x, y):
    """Points of a surface and its derivatives along x."""
    values = surface_derivatives(
        Surface(words["degree"], words["knots"], words["control_points"], words["weights"]), x, y
    )
    return values.s, values.s_u


def test_a_swept_arc_lies_on_its_cylinder():
    s, _ = points(shell_surfaces.swept(shell_surfaces.arc(25.0, 90.0, 50.0), 1, (0.0, 25.0), first=False), 0.3, U)
    np.testing.assert_allclose(np.hypot(s[:, 0], s[:, 2]), 25.0, rtol=1e-14)
    np.testing.assert_allclose(s[:, 1], 7.5, rtol=1e-14)
    assert math.degrees(math.atan2(s[-1, 2], s[-1, 0])) == pytest.approx(50.0)


def test_a_revolved_arc_lies_on_its_sphere():
    words = shell_surfaces.revolved(shell_surfaces.arc(10.0, 0.0, 72.0), 90.0)
    s, _ = points(words, *np.meshgrid(U, U))
    np.testing.assert_allclose(np.linalg.norm(s, axis=-1), 10.0, rtol=1e-14)
    np.testing.assert_allclose(s[-1, :, 2], 10.0 * math.sin(math.radians(72.0)), rtol=1e-14)


def test_the_strip_is_a_helicoid_to_the_part_of_its_width_that_it_states():
    s, _ = points(shell_surfaces.helicoid(12.0, 1.1), U, 1.0)
    angle = math.pi / 2 * U
    exact = np.stack([12.0 * U, 0.55 * np.cos(angle), 0.55 * np.sin(angle)], axis=1)
    assert np.abs(s - exact).max() < 7e-11 * 1.1


def test_the_hook_is_two_arcs_of_which_the_speeds_meet_and_stay_alike():
    words = shell_surfaces.hook((14.0, 46.0), 20.0)
    x = np.linspace(0.0, 5.0, 501)
    s, s_x = points(words, x, 0.5)
    centre = 60.0 * np.array([math.cos(math.radians(-30.0)), math.sin(math.radians(-30.0))])
    np.testing.assert_allclose(np.hypot(*s[x <= 1, :2].T), 14.0, rtol=1e-13)
    np.testing.assert_allclose(np.hypot(*(s[x >= 1, :2] - centre).T), 46.0, rtol=1e-13)
    np.testing.assert_allclose(s[:, 2], 10.0)
    length = math.radians(60.0) * 14.0 + math.radians(150.0) * 46.0
    speed = np.linalg.norm(s_x, axis=1)
    assert np.trapezoid(speed, x) == pytest.approx(length, rel=1e-4)
    assert speed.max() < 4.01 * speed.min()
    for knot in (1.0, 3.0):
        before, after = (points(words, knot + step, 0.5)[1] for step in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-6)


def test_every_case_has_a_name_a_scene_and_a_question_of_its_own():
    titles = [shell.title for shell in shell_cases.SHELLS]
    asked = [(shell.scene, str(shell.about)) for shell in shell_cases.SHELLS]
    assert len(set(titles)) == len(titles) == len(set(asked))
    for shell in shell_cases.SHELLS:
        shell_scenes.SCENES[shell.scene](load=shell.load, **shell.about)
        assert shell.meshes("standard") and shell.against.split(":")[0] in ("exact", "published", "cross-code")
        asks_of_the_solid = shell.expected is not None and bool(shell.solids("full"))
        assert (shell.allowed_solid is not None) == asks_of_the_solid


def answers(budget, wrong):
    """Outcomes of a budget as if every run had found the expected value times `wrong`."""
    for unit in shells.units(budget):
        asked = unit.arguments
        shell = next(s for s in shell_cases.SHELLS if (s.scene, s.about) == (asked["shell"], asked["about"]))
        right = (shell.expected or 0.3) / shell.factor
        found = right if shell.expected is None and asked["solver"] == "reference" else wrong * right
        move = [found if component == shell.component else 7.0 for component in "XYZ"]
        runs = [{"status": "ok", "move": move, "unknowns": 100} for _ in asked["runs"]]
        yield Outcome(unit, Measured(unit.name, asked, "ok", {"runs": runs}))


def test_cases_are_judged_in_the_words_of_their_source():
    right = shells.present(list(answers("full", 1.0)))
    assert {case.met for case in right.cases} == {True, None}
    shown = {
        case.name.rpartition(" [")[0] for case in right.cases if case.met is None and "conforming" not in case.level
    }
    assert shown == {shell.title for shell in shell_cases.SHELLS if shell.allowed is None} | {
        "thick roof, t / R = 1/10"
    }
    assert right.figures[0].value == pytest.approx(0.0, abs=1e-9)
    assert not any(case.met for case in shells.present(list(answers("quick", 1.06))).cases)


def test_a_unit_that_died_is_a_failure_of_each_of_its_cases():
    dead = [Outcome(o.asked, Measured(o.asked.name, o.asked.arguments, "failed: memory")) for o in answers("quick", 1)]
    found = shells.present(dead)
    assert {case.status for case in found.cases} == {"failed: memory"}
    assert not any(case.met for case in found.cases) and found.figures[0].met is None


def test_the_roof_is_solved_as_the_table_says():
    """8 x 8 enriched elements within the tolerance of the case, with a load whose half changes nothing."""
    shell = next(s for s in shell_cases.SHELLS if s.scene == "roof")
    runs = [
        {"load": f * shell.load, "level": {"element": "enriched", "mesh": (8, 8), "points": (4, 4, 3)}}
        for f in (1, 0.5)
    ]
    whole, half = shell_scenes.solve("roof", {}, "ancf", runs)["runs"]
    assert -whole["move"][2] == pytest.approx(shell.expected, rel=shell.allowed / 100)
    assert whole["move"][2] == pytest.approx(half["move"][2], rel=shell.allowed / 1000)
