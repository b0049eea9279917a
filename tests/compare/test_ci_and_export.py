"""What leaves the project: verdicts for build servers, tables for papers, surfaces for ParaView, a notebook's repr."""

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import synthetic_study

from compare import ci, cli, export, gate
from compare.formats import as_latex
from compare.scene import load
from compare.table import rows

ODD = 'mesh <&> "2x2" | a_b \x1b'
MARGINS = (
    gate.Margin("mesh 2x2", "ok", -0.5, -0.5, 1e-8, 0.01),
    gate.Margin(ODD, "moved", -0.51, -0.5, 2e-2, 2e4),
    gate.Margin("mesh 4x4", "failed", None, -0.5, None, None, "newton_diverged"),
    gate.Margin("mesh 8x8", "new", -0.5, None, None, None),
)
VERDICT = gate.Verdict(MARGINS, 1e-6, True, ())


def test_junit_has_a_case_per_row_and_a_failure_per_refusal():
    suite = ElementTree.fromstring(ci.junit(VERDICT, "plate"))
    assert (suite.get("tests"), suite.get("failures")) == ("4", "2")
    failed = [case for case in suite if case.find("failure") is not None]
    assert [case.find("failure").get("type") for case in failed] == ["moved", "failed"]
    assert failed[0].get("name") == ODD.replace("\x1b", "\ufffd")  # a control character is no XML
    assert "accepted -0.500000000" in failed[0].find("failure").text


def test_the_summary_is_a_table_whose_words_stay_words(tmp_path):
    text = ci.markdown(VERDICT, "plate")
    assert "the gate refuses 2 of 4 rows" in text and "\\<&\\>" in text and "\\| a\\_b" in text
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len(lines) == 2 + 3 and "**moved**" in lines[2]
    ci.write(VERDICT, "plate", None, tmp_path / "summary.md")
    ci.write(VERDICT, "plate", tmp_path / "out.xml", tmp_path / "summary.md")
    assert (tmp_path / "summary.md").read_text() == 2 * text  # appended
    assert (tmp_path / "out.xml").read_text() == ci.junit(VERDICT, "plate")


def test_latex_is_balanced_and_escaped():
    table = rows([e for e in synthetic_study.entries("quick") if e.scene.name == "cantilever"])
    text = as_latex([{**row, "groove": "a_b & 50%"} for row in table])
    lines = text.splitlines()
    width = lines[2].count(" & ") + 1
    assert "a\\_b \\& 50\\%" in text and lines[0].startswith("\\begin{tabular}{") and lines[-1] == "\\end{tabular}"
    assert all(line.replace("\\&", "").count("&") == width - 1 for line in lines if line.endswith("\\\\"))
    assert "$-0." in text and len(lines[0].partition("}{")[2]) == width + 1


@pytest.fixture
def result():
    return next(e.result for e in synthetic_study.entries("quick") if e.scene.name == "cantilever")


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_a_surface_is_read_back_as_it_was(tmp_path, result, suffix):
    export.write(result, tmp_path / f"plate{suffix}")
    mesh = meshio.read(tmp_path / f"plate{suffix}")
    np.testing.assert_allclose(mesh.points, result.outline.points, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(mesh.cells_dict["triangle"], result.outline.triangles)
    np.testing.assert_allclose(mesh.point_data["displacement"], result.outline.displacement, rtol=0, atol=1e-15)
    assert [path.name for path in tmp_path.iterdir()] == [f"plate{suffix}"]


def test_xdmf_holds_the_same_numbers(tmp_path, result):
    export.write(result, tmp_path / "plate.xdmf")
    grid = ElementTree.parse(tmp_path / "plate.xdmf").getroot().find("Domain/Grid")
    held = [
        np.array(grid.find(f"{place}/DataItem").text.split(), float).reshape(-1, 3)
        for place in ("Geometry", "Topology", "Attribute")
    ]
    outline = result.outline
    for read, known in zip(held, (outline.points, outline.triangles, outline.displacement), strict=True):
        np.testing.assert_array_equal(read, known)


def test_the_stress_of_a_surface_goes_with_it(tmp_path, result):
    stress = np.linspace(0, 2e6, len(result.outline.points))
    bent = replace(result, outline=replace(result.outline, stress=stress))
    for suffix in (".vtu", ".vtk"):
        export.write(bent, tmp_path / f"bent{suffix}")
        np.testing.assert_allclose(meshio.read(tmp_path / f"bent{suffix}").point_data["von_mises"], stress, rtol=1e-15)
    attribute = ElementTree.fromstring(export.xdmf(bent)).findall("Domain/Grid/Attribute")[1]
    assert (attribute.get("Name"), attribute.get("AttributeType")) == ("von_mises", "Scalar")
    assert attribute.find("DataItem").get("Dimensions") == str(len(stress))
    np.testing.assert_array_equal(np.array(attribute.find("DataItem").text.split(), float), stress)


def test_modes_are_a_field_each_and_what_cannot_be_exported_says_why(tmp_path, result):
    outline = replace(result.outline, modes=np.stack([result.outline.points] * 2))
    rings = replace(result, outline=outline, frequencies=np.array([1.5, 9.25]))
    assert list(export.fields(rings)) == ["mode_1_1.5_Hz", "mode_2_9.25_Hz"]
    for suffix in (".vtu", ".vtk"):
        export.write(rings, tmp_path / f"rings{suffix}")
        read = meshio.read(tmp_path / f"rings{suffix}").point_data
        assert list(read) == list(export.fields(rings))
        np.testing.assert_allclose(read["mode_2_9.25_Hz"], outline.modes[1], rtol=0, atol=1e-15)
    with pytest.raises(export.ExportError, match=r"ends with one of \.vtu"):
        export.write(result, tmp_path / "plate.stl")
    with pytest.raises(export.ExportError, match="has no surface"):
        export.write(replace(result, outline=None), tmp_path / "plate.vtu")


def test_a_notebook_shows_the_answer_with_every_word_escaped(result):
    shown = replace(result, solver="<script>alert(1)</script>")._repr_html_()
    assert "<script>" not in shown and "&lt;script&gt;" in shown
    table = ElementTree.fromstring(shown)
    held = {row[0].text: row[1].text for row in table}
    place = result.position("P")[-1]
    assert held["P at 1"] == f"({place[0]:.5f}, {place[1]:.5f}, {place[2]:.5f}) m" and held["status"] == "ok"
    assert json.dumps(held)


@pytest.fixture
def two_ladders(tmp_path, monkeypatch):
    """A scene whose enriched and conforming ladders share a mesh; an exported file holds its element's name."""
    levels = [{"mesh": mesh, "budget": "quick"} for mesh in ([4, 4], [8, 8])]
    levels.append({"mesh": [8, 8], "element": "conforming", "budget": "quick"})
    scene = load("cantilever").override({"ancf": {"time_step": 0.02, "levels": levels}}, "two")
    monkeypatch.setattr(cli, "with_companions", lambda name: [scene])
    monkeypatch.setattr(cli, "SOLVERS", {"ancf": "fake_solver", "reference": "fake_solver"})
    monkeypatch.setattr(export, "write", lambda found, path: path.write_text(found.level["element"]))
    monkeypatch.chdir(tmp_path)


def test_export_takes_the_first_ladder_and_refuses_a_level_of_two(two_ladders, capsys):
    scene, file = "two", Path("plate.vtu")
    assert cli.main(["export", scene, str(file)]) == 0
    assert capsys.readouterr().out == "two: ancf 8x8 enriched, 7x7x3 points: plate.vtu\n"
    assert file.read_text() == "enriched"
    assert cli.main(["export", scene, str(file), "--level", "8x8 conforming"]) == 0
    assert file.read_text() == "conforming"
    assert cli.main(["export", scene, str(file), "--level", "8x8"]) == 2
    assert "--level 8x8: one of 2 levels: 8x8 enriched; 8x8 conforming" in capsys.readouterr().err
    assert cli.main(["export", scene, str(file), "--level", "9x9"]) == 2
    assert "the scene has 4x4, 8x8 enriched, 8x8 conforming" in capsys.readouterr().err
