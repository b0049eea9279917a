"""Names of levels: each is told from the others of its ladders, and found again by it."""

import pytest

from compare.levels import find, finest, full_name, names
from compare.scene import AncfLevel, ReferenceLevel, load
from compare.scene import names as shipped

ENRICHED = [AncfLevel(mesh=[n, n]) for n in (4, 8)]
CONFORMING = AncfLevel(mesh=[8, 8], element="conforming")
WALLS = AncfLevel(mesh=[8, 8], fit=[0.5], walls=True)
SIZES = [ReferenceLevel(size=size) for size in (0.2, 0.1)]


@pytest.mark.parametrize(
    ("levels", "expected"),
    {
        "meshes alone": (ENRICHED, ["4x4", "8x8"]),
        "elements": ([*ENRICHED, CONFORMING], ["4x4", "8x8 enriched", "8x8 conforming"]),
        "walls": ([ENRICHED[1], WALLS], ["8x8 enriched", "8x8 enriched, fitted 0.5, walls"]),
        "rules": ([AncfLevel(mesh=[2, 2], points=n) for n in ((3, 3, 2), (7, 7, 3))], ["2x2 3x3x2", "2x2 7x7x3"]),
        "steps": (
            [AncfLevel(mesh=[1, 1], time_step=dt) for dt in (0.5, 0.25)],
            ["1x1 time_step=0.5", "1x1 time_step=0.25"],
        ),
        "lips": (
            [WALLS, WALLS.model_copy(update={"lips": True})],
            ["8x8 enriched, fitted 0.5, walls", "8x8 enriched, fitted 0.5, walls, lips"],
        ),
        "sizes": (SIZES, ["h=0.2", "h=0.1"]),
    }.values(),
)
def test_a_name_has_what_tells_a_level_from_the_others_and_no_more(levels, expected):
    assert names(levels) == expected
    assert [find(name, levels) for name in expected] == [[level] for level in levels]


def test_a_name_may_say_more_or_less_than_it_must():
    levels = [*ENRICHED, CONFORMING, WALLS]
    assert find("8x8", levels) == [ENRICHED[1], CONFORMING, WALLS]
    assert find("8x8 walls", levels) == [WALLS]
    assert find(full_name(CONFORMING), levels) == find("8x8 conforming", levels) == [CONFORMING]
    assert find("8x8 enriched", levels) == [ENRICHED[1]]  # that very name, though WALLS is enriched too
    assert find("4x4 conforming", levels) == find("conforming", levels) == find("", levels) == []


def test_the_finest_level_is_that_of_the_first_ladder():
    assert finest([*ENRICHED, CONFORMING]) is ENRICHED[1]
    assert finest([CONFORMING, *ENRICHED]) is CONFORMING
    assert finest(SIZES) is SIZES[1]
    steps = [AncfLevel(mesh=[1, 1], time_step=dt) for dt in (0.5, 0.25)]
    assert finest(steps) is steps[1]


@pytest.mark.parametrize("name", shipped())
def test_every_level_of_a_shipped_scene_has_a_name_of_its_own(name):
    scene = load(name)
    for solver in ("ancf", "reference"):
        levels = scene.ladder(solver)
        assert [find(known, levels) for known in names(levels)] == [[level] for level in levels]
