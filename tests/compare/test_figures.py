"""Plots, sketches and pictures: well formed, repeatable, themed by the page, and missing without harm."""

import re
import stat
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import synthetic_study

from compare import figures, plots
from compare.explain import statement
from compare.scene import load
from compare.sketch import sketch

H = [0.5, 0.25, 0.125]
SERIES = [
    plots.Series("ANCF 3x3x2", "ancf", H, [-0.41, -0.5, -0.54]),
    plots.Series("reference", "reference", [0.2, 0.1], [-0.55, -0.56]),
    plots.Series("a < b & c", "paper", H, [-0.4, -0.5, -0.55]),
]
LIMITS = [plots.Limit("ANCF", "ancf", -0.54, -0.556, -0.56, -0.52), plots.Limit("paper", "paper", -0.5669)]
TIMES = np.linspace(0, 1, 11)


def draw_all() -> dict[str, str]:
    """Every kind of plot once."""
    labels = ("time (s)", "height (m)")
    return {
        "value": plots.value_plot("value", "Value", "about", "height (m)", SERIES, LIMITS),
        "log": plots.log_plot("log", "Error", "about", [plots.Series("e", "ancf", H, [9, 3, 0])], "h (m)", "error (%)"),
        "history": plots.history_plot(
            "history", "Path", "about", labels, [plots.Series("a", "ancf", TIMES, -(TIMES**2))], None
        ),
        "residual": plots.history_plot(
            "residual",
            "Path",
            "about",
            labels,
            [plots.Series("a", "ancf", TIMES, -(TIMES**2)), plots.Series("b", "reference", TIMES, -TIMES)],
            plots.Series("a minus b", "difference", TIMES, TIMES),
        ),
        "bars": plots.bar_plot("bars", "Bars", "about", [plots.Bar("one", "ancf", 1.0)], "change (%)"),
        "no bars": plots.bar_plot("empty", "Bars", "about", [plots.Bar("none", "ancf", 0.0)], "change (%)"),
    }


DRAWN = draw_all()


@pytest.mark.parametrize("name", DRAWN)
def test_a_plot_is_well_formed_and_says_what_it_shows(name):
    """It parses as XML alone; title and description are there for whoever cannot see it."""
    root = ElementTree.fromstring(DRAWN[name])
    space = "{http://www.w3.org/2000/svg}"
    assert root.tag == f"{space}svg" and root.find(f"{space}title").text and root.find(f"{space}desc").text


@pytest.mark.parametrize("name", DRAWN)
def test_a_plot_takes_its_colours_from_the_page(name):
    """No ink but the page's, no fixed series colour, no style that would reach beyond the plot."""
    svg = DRAWN[name]
    assert plots.INK not in svg and "<style" not in svg
    assert not re.search(r"(?:fill|stroke): #(?!f{6})[0-9a-f]{6}", svg)


def test_equal_input_gives_equal_bytes():
    """Ids are hashed with the plot's name and no date is written."""
    assert draw_all() == DRAWN


def test_ids_of_two_plots_do_not_meet():
    """Two plots on one page must not refer to each other's clip paths."""
    one, other = (set(re.findall(r' id="([^"]+)"', DRAWN[name])) for name in ("value", "residual"))
    assert one and other and not one & other


def test_words_are_escaped():
    """A label with markup in it stays a label."""
    assert "a &lt; b &amp; c" in DRAWN["value"]


def test_what_cannot_stand_on_a_logarithmic_axis_is_left_out():
    """An error of zero on the third level draws what the first two levels alone draw."""
    two = [plots.Series("e", "ancf", H[:2], [9, 3])]
    assert plots.log_plot("log", "Error", "about", two, "h (m)", "error (%)") == DRAWN["log"]


@pytest.mark.parametrize("name", ["cantilever", "cantilever_patch", "rounded_groove", "cylinder_panel"])
def test_a_sketch_is_well_formed_and_names_what_the_scene_has(name):
    """Grooves, probe and clamp of every kind of shipped scene."""
    scene = load(name)
    drawn = sketch(scene)
    ElementTree.fromstring(drawn)
    for groove in scene.grooves:
        assert groove.name in drawn
    assert scene.probes[0].name in drawn


def test_a_sketch_and_the_statement_name_every_support_and_load():
    supports = [
        {"kind": "symmetry", "edge": "y1", "normal": "Y"},
        {"kind": "hold", "edge": "x1", "components": ["X", "Z"], "over": "middle"},
        {"kind": "hold", "corner": "x0y0", "components": ["Y"]},
        {"kind": "hold", "whole": True, "components": ["Z"]},
    ]
    loads = [
        {"kind": "pressure", "face": "top", "pressure": -2.5},
        {"kind": "moment", "edge": "x1", "moment": [0.0, 4.0, 0.0]},
    ]
    scene = load("cantilever_plain").override({"supports": supports, "loads": loads, "analysis.kind": "static"})
    drawn = sketch(scene)
    ElementTree.fromstring(drawn)
    for words in ("symmetry Y", "X Z", "\u22122.5 Pa on the top", "+4 N m", "Z held throughout"):
        assert words in drawn
    assert drawn.count('r="5"') == 7 + 1  # rollers of the edge and of the corner
    stated = statement(scene)
    for words in (
        ("clamped edges", "none"),
        ("symmetry", "y1 in a plane of normal Y"),
        ("held", "X Z of x1, over its middle"),
        ("held", "Y of corner x0y0, over its face"),
        ("held", "Z of the whole plate"),
        ("load", "pressure, -2.5 Pa into the top face, dead, constant"),
        ("load", "moment, (0, 4, 0) N m on x1, turning with it, constant"),
    ):
        assert words in stated


JOBS = [
    figures.Job("mesh", "a mesh", "mesh", "ancf", synthetic_study.body(4, -0.5), below=True),
]


@pytest.mark.parametrize(
    ("script", "said"),
    [("kill -SEGV $$", "signal 11"), ("echo no GL >&2; exit 3", "no GL"), ("exit 4", "exit code 4")],
)
def test_a_dying_renderer_is_a_reason_not_a_crash(script, said, tmp_path, monkeypatch):
    """VTK without OpenGL ends its process by a signal; the parent lives and knows why."""
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(sys, "executable", str(python))
    made, reason = figures.render(JOBS)
    assert made == [] and said in reason
