"""What the distance between the solvers is made of, on ladders whose limits are known."""

import pytest
import synthetic_study

from reports import split


def entries(scene="cantilever_plain"):
    """Made-up heights: the reference follows -0.5015 m (1 - 0.8 h²)."""
    return [entry for entry in synthetic_study.entries() if entry.scene.name == scene]


def test_the_parts_add_up_and_each_is_its_own_ladders():
    """The reference at h = 0.05 stands 0.8 h² / (1 - 0.8 h²) = 0.2004 % before its limit; ANCF's is nearer to rest."""
    (line,) = split.split(entries("cantilever_plain_patch"))
    parts = [line[key] for key, _, _ in split.PARTS]
    assert sum(parts) == pytest.approx(line["total_percent"], abs=1e-12)
    assert line["reference_percent"] == pytest.approx(0.2004, abs=1e-4)
    assert line["model_percent"] == pytest.approx(-1.5, abs=0.05)  # limits -0.4940 and -0.5015 m
    assert line["reading"].startswith("the models differ") and line["uncertain_percent"] < abs(line["model_percent"])


def test_without_a_limit_nothing_is_split():
    """A ladder that has no Richardson value makes the split inconclusive, with its reason."""
    coarse = [e for e in entries() if e.solver == "ancf" or e.level.size > 0.15]
    (line,) = split.split(coarse)
    assert line["model_percent"] is None and "fewer than three levels" in line["reading"]
    assert line["total_percent"] is not None


def test_costs_are_told_or_refused_with_a_reason():
    found = split.costs(entries())
    assert {line["ladder"] for line in found} == {"reference", "ANCF 3x3x2", "ANCF 7x7x3"}
    for line in found:
        known = [line[f"seconds_{part:g}"] for part in split.COSTS]
        assert line["refused"] or None not in known
