"""The tetrahedra fill the solid, on the flat box and on a quarter cylinder."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import meshio
import numpy as np
import pytest

from compare.scene import load
from reference_fe import mesh
from reference_fe.geometry import Band, MeshError
from reference_fe.loads import region_share
from reference_fe.mesh import Spacing, _check, make, store
from reference_fe.outline import surface_triangles
from reference_fe.unpack import mid_surface, plate_of, spacing_of


@pytest.mark.parametrize("size", [0.3, 0.1])
def test_flat_mesh_fills_the_solid_exactly(build, size):
    solid = build.solid(build.grooved, size)
    assert math.isclose(solid.volume, 1.0 * 0.8 * 0.1 - 0.2 * 0.06, rel_tol=1e-12)
    assert solid.smallest_jacobian > 0


def test_mid_edge_nodes_of_a_flat_mesh_lie_midway(build):
    solid = build.solid(build.grooved, 0.3)
    edges, points = solid.mesh.edges, solid.mesh.doflocs
    middle = points[:, edges].mean(axis=1)
    assert np.abs(points[:, solid.mesh.nvertices :] - middle).max() < 1e-12


def test_equal_questions_have_equal_meshes_at_a_curved_groove(monkeypatch):
    """To the last digit, though gmsh's optimiser, which this groove needs, rounds otherwise each time."""
    frame, surface = mid_surface(scene := load("rounded_groove"))
    plate = plate_of(scene, frame, surface)
    made = partial(make, plate, spacing_of(plate, 0.2))
    one, other = made().mesh, made().mesh
    np.testing.assert_array_equal(one.doflocs, other.doflocs)
    np.testing.assert_array_equal(one.t, other.t)
    monkeypatch.setattr(mesh, "NUDGE", 1e-14)
    raw = [made().mesh.doflocs for _ in range(2)]
    assert 0 < np.abs(raw[0] - raw[1]).max() < 1e-12
    assert np.abs(raw[0] - one.doflocs).max() <= 0.5e-6 * 0.05  # half a step


def test_sizes_follow_the_spacing(build):
    near = (0.25, 0.2, (0.0, 0.0), (0.0, 0.8), (-0.1, 0.1))
    coarse = build.solid(build.grooved, 0.3)
    graded = make(build.grooved, Spacing(0.3, (near,)))
    longest = [
        np.ptp(solid.box.p[0][solid.mesh.t], axis=0)[(solid.box.p[0][solid.mesh.t] < 1e-9).any(axis=0)].max()
        for solid in (coarse, graded)
    ]
    assert longest[1] < 0.6 * longest[0]


def test_regions_are_filled_by_whole_tetrahedra(build):
    region = ((0.37, 1.0), (0.43, 0.8))
    solid = make(replace(build.grooved, regions=(region,)), Spacing(0.3))
    share = region_share(solid, region)
    beside, above = 0.3 * 0.1, 0.07 * 0.04  # sections of the region beside and above the groove
    y = (beside * 0.65 + above * 0.465) / (beside + above)
    assert np.allclose(solid.box.doflocs[:2] @ share, [0.685, y], rtol=1e-12)


def test_quarter_cylinder_has_its_volume_and_its_radii(build):
    solid = build.curved(0.2)
    exact = math.pi / 4 * (1.1**2 - 0.9**2) * 0.4
    assert math.isclose(solid.exact_volume, exact, rel_tol=1e-5)  # quadrature of degree 6 on elements of 0.2 m
    radius = np.hypot(solid.mesh.doflocs[1], solid.mesh.doflocs[2])
    assert np.abs(radius - 1 - solid.box.doflocs[2]).max() < 1e-12


def test_volume_of_the_mapped_mesh_converges_at_fourth_order(build):
    errors = [abs(solid.volume / solid.exact_volume - 1) for solid in (build.curved(0.4), build.curved(0.1))]
    assert errors[0] / errors[1] > 4**3.4  # two halvings; quadratic elements give fourth order in volume


def test_grooves_on_a_cylinder_are_cut_along_normals(build):
    from reference_fe.geometry import Plate

    surface = build.cylinder(1.0, 0.4)
    around = surface.frame.interval(1, (0.0, 1.0))[1]
    groove = Band(-1, 0, (around / 4, around / 2), (0.0, 0.4), 0.1)
    solid = make(Plate(0.4, around, 0.2, grooves=(groove,)), Spacing(0.15), surface)
    start, end = _angle(0.25), _angle(0.5)
    removed = (end - start) / 2 * (1.0**2 - 0.9**2) * 0.4
    exact = math.pi / 4 * (1.1**2 - 0.9**2) * 0.4 - removed
    assert math.isclose(solid.volume, exact, rel_tol=2e-5)  # error of the quadratic mesh at this size


def _angle(t: float) -> float:
    """Angle of the rational quadratic quarter circle at its parameter: weights 1, cos 45°, 1."""
    w = 2**-0.5
    basis = np.array([(1 - t) ** 2, 2 * w * t * (1 - t), t**2])
    x, y = basis @ [[1, 0], [1, 1], [0, 1]] / basis.sum()
    return math.atan2(y, x)


def test_an_inverted_tetrahedron_is_a_named_failure(build):
    mesh = build.solid(build.grooved, 0.3).mesh
    points = mesh.doflocs.copy()
    points[0, mesh.t[0, 0]] += 2.0
    with pytest.raises(MeshError) as failure:
        _check(replace(mesh, doflocs=points), 0.068)
    assert failure.value.status == "mesh_inverted"


def test_a_mesh_that_misses_the_solid_is_a_named_failure(build):
    with pytest.raises(MeshError) as failure:
        _check(build.solid(build.grooved, 0.3).mesh, 0.08)
    assert failure.value.status == "mesh_volume"


def test_stored_mesh_reads_back(build, tmp_path):
    solid = build.curved(0.4)
    store(solid, tmp_path / "new" / "plate.vtu")
    read = meshio.read(tmp_path / "new" / "plate.vtu")
    corners = read.points[read.cells_dict["tetra10"][:, :4]]
    assert np.array_equal(read.points, solid.mesh.doflocs.T)
    assert np.all(np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0)


def test_outline_closes_around_the_volume(build):
    solid = build.solid(build.grooved, 0.3)
    nodes, triangles, lines = surface_triangles(solid)
    corner = solid.mesh.doflocs.T[nodes][triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2
    groove = 2 * 0.06 * 1.0 - 2 * 0.2 * 0.06
    assert math.isclose(np.linalg.norm(area, axis=1).sum(), 2 * (0.8 + 0.1 + 0.08) + groove, rel_tol=1e-12)
    assert lines.max() < nodes.size and np.all(lines[:, 0] != lines[:, 1])
