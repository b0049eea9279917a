"""Answers of other codes read from files: what joins the table, and what is refused with file, place and reason."""

import json

import meshio
import numpy as np
import pytest
import synthetic_study

from compare import cli
from compare.external import exported
from compare.external.exported import ExportError
from compare.scene import load
from compare.table import rows
from reports import scene as exhibit
from reports import third

PLATE = load("cantilever_plain")
PATCH = load("cantilever_plain_patch")


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def bricks(n, lift, thick=0.05):
    """n x n x 2 hexahedra of the unit plate with displacement (0, 0, lift(x, y))."""
    x, z = np.linspace(0, 1, n + 1), np.linspace(-thick / 2, thick / 2, 3)
    points = np.stack(np.meshgrid(x, x, z, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(n + 1, n + 1, 3)
    a = number[:-1, :-1, :-1].ravel()
    step = np.array([0, 3 * (n + 1), 3 * (n + 1) + 3, 3])
    cells = a[:, None] + np.concatenate([step, step + 1])
    moved = np.zeros_like(points)
    moved[:, 2] = lift(points[:, 0], points[:, 1])
    return points, cells, moved


def test_a_table_joins_with_its_seconds(tmp_path):
    path = write(tmp_path / "abaqus.csv", "# Abaqus C3D20R\nh;value;seconds\n0.2;-0.498;3\n0.1;-0.5005;21\n")
    found = exported.entries(PLATE, path, "Abaqus")
    table = rows([e for e in synthetic_study.entries("quick") if e.scene.name == PLATE.name] + found)
    ours = [row for row in table if row["solver"] == "Abaqus"]
    assert [(row["mesh"], row["value"], row["wall_seconds"]) for row in ours] == [
        ("h=0.2", -0.498, 3.0),
        ("h=0.1", -0.5005, 21.0),
    ]
    assert ours[1]["element"] == "as in abaqus.csv" and ours[1]["unknowns"] is None


def test_three_levels_of_a_table_have_an_order(tmp_path):
    lines = "".join(f"{h},{-0.5 + 0.4 * h**2!r}\n" for h in (0.4, 0.2, 0.1))
    found = exported.entries(PATCH, write(tmp_path / "a.csv", "h,value\n" + lines), "A")
    last = rows(found)[-1]
    assert last["order"] == pytest.approx(2.0) and last["extrapolated"] == pytest.approx(-0.5)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_a_field_is_read_at_the_probe(tmp_path, suffix):
    """z = -0.5 x at the corner P is -0.5; bricks of 1/4 by 1/4 by 1/40 m have a mean edge of 0.176 m."""
    points, cells, moved = bricks(4, lambda x, y: -0.5 * x)
    path = tmp_path / f"plate{suffix}"
    meshio.write(path, meshio.Mesh(points, [("hexahedron", cells)], {"U": moved}))
    (entry,) = exported.entries(PLATE, path, "Ansys")
    assert rows([entry])[0]["value"] == pytest.approx(-0.5, abs=1e-12)
    assert entry.result.h == pytest.approx((0.25 * 16 + 0.025 * 8) / 24, rel=1e-9)  # each face counts its edges
    assert len(entry.result.outline.triangles) == 2 * (2 * 16 + 4 * 4 * 2)
    assert exported.entries(PLATE, path, "Ansys", h=0.3)[0].result.h == 0.3


def test_a_patch_is_read_as_its_mean(tmp_path):
    """The mean of a linear field is its value at the middle of the patch, wherever the nodes lie."""
    points, cells, moved = bricks(7, lambda x, y: 0.3 * x + 0.1 * y)
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("hexahedron", cells)], {"displacement": moved}))
    (x0, x1), (y0, y1) = PATCH.probes[0].region
    (entry,) = exported.entries(PATCH, tmp_path / "a.vtu", "A")
    assert rows([entry])[0]["value"] == pytest.approx(0.15 * (x0 + x1) + 0.05 * (y0 + y1), rel=1e-9)


def test_a_patch_is_read_over_the_material_that_grooves_and_protrusions_leave(tmp_path):
    """The mean of a linear field is its value at the centroid of the boxes that the patch is made of.

    Of its 0.4 m x 0.4 m a quarter is 0.01 m thick, over a groove, and a half beside it 0.07 m, under a protrusion.
    """
    groove = {"name": "cut", "face": "bottom", "along": "y", "across": [0.5, 0.6], "depth": 0.04}
    rib = {"name": "rib", "face": "top", "along": "y", "across": [0.7, 1.0], "depth": 0.02}
    changes = {"grooves": [groove], "protrusions": [rib], "probes.0.region": [[0.5, 0.9], [0.8, 1.2]]}
    scene = PATCH.override(changes)
    points, cells, moved = bricks(4, lambda x, y: 0.1 * x - 0.3 * y, thick=0.1)
    moved[:, 2] += 0.5 * points[:, 2]
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("hexahedron", cells)], {"U": moved}))
    found = exported.entries(scene, tmp_path / "a.vtu", "Abaqus")[0].result
    boxes = np.array([(0.55, 0.9, 0.02, 0.1 * 0.01), (0.65, 0.9, 0.0, 0.1 * 0.05), (0.8, 0.9, 0.01, 0.2 * 0.07)])
    centre = boxes[:, 3] @ boxes[:, :3] / boxes[:, 3].sum()
    assert found.probe_position[0] == pytest.approx(centre, abs=1e-12)
    assert found.displacement[0, 0, 2] == pytest.approx(centre @ [0.1, -0.3, 0.5], abs=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "needs a header line"),
        ("h,value\n", "needs a header line"),
        ("h,height\n0.1,1\n", r"line 1: no column value in \['h', 'height'\]"),
        ("h,value\n0.1\n", "line 2: 1 cells under 2 headers"),
        ("h,value\n0.1,tall\n", "line 2: value = 'tall': wanted a number"),
        ("h,value\n0.1,nan\n", "line 2: value = nan: wanted a number"),
        ("h,value\n-0.1,1\n", "line 2: h = -0.1: wanted an element length"),
        ("h,value\n0.1,1\n0.1,2\n", "line 3: h = 0.1 occurs twice"),
        ("h,value,unknowns\n0.1,1,2.5\n", "line 2: unknowns = 2.5: wanted a whole number"),
    ],
)
def test_a_bad_table_is_refused_by_line_and_reason(tmp_path, text, said):
    with pytest.raises(ExportError, match=said):
        exported.entries(PLATE, write(tmp_path / "bad.csv", text), "A")


def test_frequencies_need_every_mode(tmp_path):
    rings = load("plate_modes")
    with pytest.raises(ExportError, match="a column mode says which"):
        exported.entries(rings, write(tmp_path / "a.csv", "h,value\n0.1,3\n"), "A")
    with pytest.raises(ExportError, match="the scene asks for 1 to"):
        exported.entries(rings, write(tmp_path / "a.csv", "h,mode,value\n0.1,2,3\n"), "A")
    every = "".join(f"0.1,{mode},{10.0 * mode}\n" for mode in range(1, rings.analysis.count + 1))
    found = rows(exported.entries(rings, write(tmp_path / "a.csv", "h,mode,value\n" + every), "A"))
    assert [row["value"] for row in found][:2] == [10.0, 20.0]


def test_a_bad_field_is_refused_with_the_reason(tmp_path):
    def read(name, mesh, **more):
        meshio.write(tmp_path / name, mesh)
        return exported.entries(PLATE, tmp_path / name, "A", **more)

    points, cells, moved = bricks(2, lambda x, y: x)
    solid = [("hexahedron", cells)]
    with pytest.raises(ExportError, match=r"no field named like a displacement .* among the point data \['T'\]"):
        read("a.vtu", meshio.Mesh(points, solid, {"T": moved[:, 0]}))
    with pytest.raises(ExportError, match="no field 'V' among the point data"):
        read("a.vtu", meshio.Mesh(points, solid, {"U": moved}), array="V")
    with pytest.raises(ExportError, match=r"field 'U' has shape"):
        read("a.vtu", meshio.Mesh(points, solid, {"U": moved[:, :2]}))
    with pytest.raises(ExportError, match=r"probe P at .* lies outside the nodes"):
        read("a.vtu", meshio.Mesh(points * 0.5, solid, {"U": moved}))
    with pytest.raises(ExportError, match="no finite numbers"):
        read("a.vtu", meshio.Mesh(points, solid, {"U": moved * np.nan}))
    with pytest.raises(ExportError, match=r"give it \(--h METRES\)"):
        read("a.vtu", meshio.Mesh(points, [("vertex", np.arange(3)[:, None])], {"U": moved}))


@pytest.mark.parametrize("name", ["a.vtu", "a.unknown", "a.vtk"])
def test_what_is_no_mesh_is_an_error_and_ends_nothing(tmp_path, name):
    """meshio prints and ends the program at some of these."""
    with pytest.raises(ExportError, match="cannot be read as a mesh"):
        exported.entries(PLATE, write(tmp_path / name, "not a mesh"), "A")
    with pytest.raises(ExportError, match="no such file"):
        exported.entries(PLATE, tmp_path / "none.vtu", "A")


def test_a_third_solver_is_on_the_page_with_its_ratios(tmp_path):
    """At h = 0.2 it lies twice as far from the reference's limit as the reference and took twice its time."""
    ours = [e for e in synthetic_study.entries(outlines=False) if e.scene.name == PATCH.name]
    level = next(e for e in ours if e.solver == "reference" and e.level.size == 0.2)
    far = -0.5015 * (1 - 2 * 0.8 * 0.2**2)
    path = write(tmp_path / "other.csv", f"h,value,seconds\n0.2,{far!r},{2 * level.wall_seconds!r}\n")
    entries = ours + exported.entries(PATCH, path, "Other <b>")
    (line,) = third.content(entries)["third"]
    assert line["error_ratio"] == pytest.approx(2.0, rel=1e-6) and line["time_ratio"] == pytest.approx(2.0)
    page = exhibit.publish(PATCH, entries, rows(entries), tmp_path)
    text, content = page.read_text(), json.loads(page.with_suffix(".json").read_text())
    assert "Other &lt;b&gt;" in text and "<b>" not in text
    assert content["third"] == [line] and "A third solver beside the two" in text


@pytest.mark.parametrize("name", ["ancf", "ANCF", " reference", "", "  ", "a/b", "a\\b", "..", "a\nb", "a" * 101])
def test_a_third_solver_needs_a_name_of_its_own_that_may_name_files(tmp_path, capsys, monkeypatch, name):
    monkeypatch.setattr(cli, "solved", lambda *_: pytest.fail("it began to solve"))
    good = write(tmp_path / "good.csv", "h,value\n0.1,1\n")
    assert cli.main(["compare", "cantilever_plain", str(good), "--name", name]) == 2
    assert f"--name {name!r}: " in capsys.readouterr().err
    assert exported.entries(PLATE, good, "Code (3.1) <b>")[0].solver == "Code (3.1) <b>"


def test_the_command_refuses_a_bad_file_before_it_solves(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cli, "solved", lambda *_: pytest.fail("it began to solve"))
    bad = write(tmp_path / "bad.csv", "h,value\n0.1,x\n")
    assert cli.main(["compare", "cantilever_plain", str(bad), "--name", "A"]) == 2
    assert "line 2: value = 'x'" in capsys.readouterr().err
    assert cli.main(["compare", "cantilever_plain", str(bad), "--name", "reference"]) == 2
