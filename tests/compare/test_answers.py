"""What is compared of two answers: displacements, at the right levels, under names that tell them apart."""

import math
from dataclasses import replace

import fake_solver
import numpy as np
import pytest

from compare.difference import between
from compare.progress import line
from compare.scene import SceneError, load
from compare.study import Entry
from compare.table import answer, at_rest, digits, error, finest_reference, highest_order, quantity, rows
from reports import probes, scene, sections, split
from reports.ladders import ladders

PLATE = load("cantilever_plain").override({"published": None, "companions": []})
LADDERS = {
    "ancf": {"levels": [{"mesh": [n, n], "element": "enriched", "time_step": 0.02} for n in (2, 4, 8)]},
    "reference": {"levels": [{"size": size, "time_step": 0.02} for size in (0.4, 0.2, 0.1)]},
}
LIMIT = -2.5e-3  # m
OWN = "errors are measured from its own finest level"


def moved(stated, solver, level, u_z, height=0.0, u_x=0.0):
    """An entry whose first probe was at a height at rest and moved by (u_x, 0, u_z)."""
    made = fake_solver.solve(stated, level)
    displacement = np.zeros_like(made.displacement)
    displacement[:, :, 2], displacement[:, :, 0] = u_z, u_x
    place = made.probe_position.copy()
    place[:, 2] = height
    result = replace(made, displacement=displacement, probe_position=place)
    return Entry(stated, None, solver, level, result, "ok", "", 1.5, 3, True, f"{solver}{level}")


def study(stated, height=0.0, order=1):
    """Both ladders: ANCF converges to LIMIT with order 2, the reference to 1.01 LIMIT."""
    found = []
    for solver, limit in (("ancf", LIMIT), ("reference", 1.01 * LIMIT)):
        for level in stated.ladder(solver)[::order]:
            h = getattr(level, "size", None) or 1 / level.mesh[0]
            found.append(moved(stated, solver, level, limit * (1 - 0.1 * h**2), height))
    return found


@pytest.fixture(scope="module")
def stated():
    return PLATE.override(LADDERS)


def test_percentages_do_not_depend_on_where_the_plate_lies(stated):
    """Height, order, band and errors of a plate at Z = 0 and of the same one at Z = 10."""
    low, high = (rows(study(stated, height)) for height in (0.0, 10.0))
    for key in ("error_reference_percent", "order", "sequence", "gci_percent"):
        assert [row[key] for row in high] == [
            row[key] if isinstance(row[key], (str, type(None))) else pytest.approx(row[key], rel=1e-6) for row in low
        ]
    assert low[2]["gci_percent"] is not None and low[0]["error_reference_percent"] == pytest.approx(-3.3, abs=0.2)
    (shifted,) = split.split(study(stated, 10.0))
    assert shifted["total_percent"] == pytest.approx(-0.95, abs=0.1)
    pair = [entry.result for entry in study(stated, 10.0)[2::3]]
    assert between(*pair).percent == pytest.approx(shifted["total_percent"])


def test_one_sign_means_one_thing(stated):
    """ANCF nearer to rest than the reference is negative in the rows, in the figures and in the parts."""
    entries = study(stated)
    (figure,) = [f for f in scene.figures(entries) if f.name.endswith("ancf_reference_percent")]
    (parts,) = split.split(entries)
    assert rows(entries)[2]["error_reference_percent"] == figure.value == parts["total_percent"] < 0
    assert parts["model_percent"] < 0 and "farther from where it was at rest" in figure.note


def test_a_ladder_may_be_stated_from_fine_to_coarse(stated):
    entries = study(stated)
    for one, other in zip(ladders(entries, stated.name), ladders(entries[::-1], stated.name)[::-1], strict=True):
        assert one.finest is other.finest and one.convergence == other.convergence
    assert one.convergence.gci is not None


def test_of_two_time_steps_the_smaller_one_judges():
    """And each has a name of its own."""
    levels = [{"size": 0.3, "time_step": step} for step in (0.02, 0.005)]
    both = PLATE.override({**LADDERS, "reference": {"levels": levels}})
    coarse, fine = (
        moved(both, "reference", level, u) for level, u in zip(both.ladder("reference"), (1e-3, 2e-3), strict=True)
    )
    assert finest_reference(coarse, [coarse, fine]) is fine
    labels = [ladder.label for ladder in ladders([coarse, fine], both.name)]
    assert labels == ["reference, time step 0.02", "reference, time step 0.005"]
    assert len({figure.name for figure in scene.figures([coarse, fine])}) == 2


def test_formulations_are_series_of_their_own():
    levels = [{"mesh": [2, 2], "time_step": 0.02, "volumetric": kind} for kind in ("relaxed", "reduced", "full")]
    rubber = {"kind": "mooney-rivlin", "mu10": 1e5, "mu01": 1e4, "bulk_modulus": 1e8, "density": 1100.0}
    stated = PLATE.override({"material": rubber, "ancf": {"levels": levels}, "reference": None})
    found = [replace(moved(PLATE, "ancf", level, LIMIT), scene=stated) for level in stated.ladder("ancf")]
    assert len({row["element"] for row in rows(found)}) == len(ladders(found, stated.name)) == 3


def test_a_second_ladder_has_a_figure_of_its_own(stated):
    both = stated.override(
        {"ancf": {"levels": [*LADDERS["ancf"]["levels"], {"mesh": [8, 8], "element": "conforming", "time_step": 0.02}]}}
    )
    entries = [moved(both, "ancf", level, LIMIT) for level in both.ladder("ancf")]
    entries.append(moved(both, "reference", both.ladder("reference")[0], 2 * LIMIT))
    found = {f.name: f.value for f in scene.figures(entries) if f.name.endswith("reference_percent")}
    assert len(found) == 2 and set(found.values()) == {-50.0}


def test_a_row_printed_for_a_rule_is_judged_there():
    printed = [
        {"mesh": [2, 2], "value": v, "cell": "a", "points": p} for v, p in ((-0.1, [3, 3, 2]), (-0.15, [7, 7, 3]))
    ]
    own = {"mesh": [2, 2], "element": "conforming", "time_step": 0.02}
    levels = [{**own, "points": p} for p in ([3, 3, 2], [7, 7, 3], [5, 5, 3])]
    stated = PLATE.override({"published": {"source": "a", "rows": printed}, "ancf": {"levels": levels}})
    found = rows([moved(stated, "ancf", level, -0.12) for level in stated.ladder("ancf")])
    assert [row["paper"] for row in found] == [-0.1, -0.15, -0.1]


def test_a_groove_stated_as_a_profile_bounds_the_order_alike():
    """Upright walls are as sharp as a section of constant depth; the plate solver has no such edge."""
    groove = {"name": "g", "face": "bottom", "along": "x"}
    wall = [[0.4, 0.0], [0.4, 0.02], [0.6, 0.02], [0.6, 0.0]]
    profile = {"degree": 1, "control_points": wall, "knots": [0, 0, 1, 2, 3, 3]}
    for own in ({"across": [0.4, 0.6], "depth": 0.02}, {"profile": profile}):
        entries = study(PLATE.override({**LADDERS, "grooves": [{**groove, **own}]}))
        assert [highest_order(e) for e in entries] == [math.inf] * 3 + [pytest.approx(1.089, abs=1e-3)] * 3


def test_a_component_of_the_displacement_may_be_the_answer(stated):
    """Its percentages are of itself, and what both leave at rest has none."""
    along = stated.override({"answer": "u_x"})
    moves = (("ancf", -1e-19, 0.5), ("reference", -3e-19, 0.4))
    pair = [moved(along, solver, along.ladder(solver)[0], u_z, u_x=u_x) for solver, u_z, u_x in moves]
    assert quantity(along) == "displacement u_x of P" and [answer(e) for e in pair] == [0.5, 0.4]
    assert rows(pair)[0]["error_reference_percent"] == pytest.approx(25)
    down = [replace(entry, scene=stated) for entry in pair]
    assert rows(down)[0]["error_reference_percent"] is None and error(down[0], -2e-19) is None
    assert [at_rest(entry) for entry in pair] == [0.0, 0.0]
    assert [line["refused"] for line in split.costs(down)] == ["the answer is none", OWN]
    for wrong in ({"published": {"source": "a", "rows": []}}, {"analysis": {"kind": "modes", "count": 2}, "loads": []}):
        with pytest.raises(SceneError, match="answer = 'u_x'"):
            along.override(wrong)


def test_small_answers_have_five_digits(stated):
    assert digits([-0.41, None]) == ".5f" and digits([-6.5785e-5]) == ".9f" and digits([18.7466], 19.0) == ".5f"
    assert "-0.0000065785 m" in line(moved(stated, "ancf", stated.ladder("ancf")[0], -6.5785e-6))
    assert "10.0000065785 m" in line(moved(stated, "ancf", stated.ladder("ancf")[0], 6.5785e-6, 10.0))


def test_every_probe_is_told_where_there_are_several(stated):
    two = stated.override({"probes": [{"name": name, "at": [x, 1.0, 0.0]} for name, x in (("P", 1.0), ("Q", 0.5))]})
    found = probes.rows([moved(two, "ancf", level, LIMIT) for level in two.ladder("ancf")])
    assert [(row["probe"], row["mesh"], row["u_z"]) for row in found] == [("P", "8x8", LIMIT), ("Q", "8x8", LIMIT)]
    assert probes.rows(study(stated)) == []


@pytest.mark.parametrize(
    ("greatest", "times"), [(0.0, 1), (0.5, 1), (0.02, 1), (0.004, 10), (6.6e-5, 1000), (1e-9, 1e8)]
)
def test_a_displacement_too_small_to_be_seen_is_drawn_larger(greatest, times):
    """By a power of ten, up to a tenth of the plate of 1 m by 1 m."""
    assert sections._times(greatest, np.array([1.0, 1.0, 0.01])) == times
