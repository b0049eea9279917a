"""Tensors split by parity against whole ones and against the integrals point by point."""

import numpy as np
import pytest

import ancf.system
from ancf.packing import SPAN
from ancf.parity import NONE, basis, share, split
from ancf.quadratic_form import QuadraticElements
from ancf.shape import ENRICHED, FAMILY
from ancf.sharing import possible, sharing
from ancf.split_form import FEWER, SplitFormElements
from ancf.supports import free_edges
from ancf.unpack import bands_of, build, held_of, material_of
from compare.scene import AncfLevel, load

CASES = [
    ("cantilever_plain_patch", (3, 3)),  # an image of each kind, elements of all mirrors
    ("cantilever_plain_patch", (2, 5)),  # sides unlike
    ("cantilever_plain_patch", (7, 7)),  # more than one portion
    ("cantilever", (5, 3)),  # grooves: mirrors along x alone or none
]
ROUND_OFF = 1e-12  # of the largest entry: thousands of terms of 1e-16 each


def model(scene, mesh, **more):
    return build(load(scene), AncfLevel(mesh=mesh, points=(5, 5, 3), time_step=0.02, **more))


def kinds_of_elements(monkeypatch, scene, mesh):
    """The same plate with split tensors and with whole ones."""
    found = []
    for chosen in (True, False):
        monkeypatch.setattr(ancf.system, "is_split", lambda *arguments, chosen=chosen: chosen)
        found.append(model(scene, mesh))
    split_ones, whole = found
    assert isinstance(split_ones.body.elements, SplitFormElements)
    assert isinstance(whole.body.elements, QuadraticElements)
    return split_ones, whole


def answers(plate):
    """Force, tangent and energy at two states, alone and with a further term, in an order that reuses stress."""
    rng = np.random.default_rng(1)
    acting, shape = plate.system, plate.mesh.vectors.shape
    q, p, x = (plate.mesh.vectors + 0.05 * rng.standard_normal(shape) for _ in range(3))
    more = ((0.3, x.ravel()),)
    found = []
    for state in (q.ravel(), p.ravel(), q.ravel()):
        found += [acting.internal_total(state), acting.tangent(state), acting.energies(state, state)[1]]
        found += [acting.internal_total(state, more), acting.tangent(state, more), acting.energies(state, state)[1]]
        found += [acting.tangent(state), acting.internal_total(state)]
    return found


@pytest.mark.parametrize(("scene", "mesh"), CASES)
def test_split_tensors_answer_as_whole_ones(monkeypatch, scene, mesh):
    for ours, theirs in zip(*map(answers, kinds_of_elements(monkeypatch, scene, mesh)), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUND_OFF * np.abs(theirs).max())


def test_split_tensors_are_the_integrals_point_by_point():
    """A 3x3 plate whose elements lie inside, on edges and in corners."""
    plate = model(*CASES[0])
    acting, body = plate.system, plate.body
    assert isinstance(body.elements, SplitFormElements)
    scene = load(CASES[0][0])
    free, fill = free_edges(plate.mesh, held_of(scene, plate.mesh)), (scene.thickness, material_of(scene))
    points = ancf.system.body(plate.mesh, bands_of(scene), *fill, 2000.0, (5, 5, 3), "subdomain", True, free)
    twin = ancf.system.system(points, held_of(scene, plate.mesh), (), scene.thickness)
    q = (plate.mesh.vectors + 0.05 * np.random.default_rng(2).standard_normal(plate.mesh.vectors.shape)).ravel()
    for name in ("internal_total", "tangent"):
        ours, theirs = (getattr(each, name)(q) for each in (acting, twin))
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=ROUND_OFF * np.abs(theirs).max())
    assert acting.energies(q, q)[1] == pytest.approx(twin.energies(q, q)[1], rel=ROUND_OFF)


def test_energy_behind_a_force_elsewhere_is_that_of_its_own_state():
    """The stress that is kept belongs to one state: another one does not see it, nor after a tangent."""
    plate = model(*CASES[0])
    elements, fresh = plate.body.elements, model(*CASES[0]).body.elements
    rng = np.random.default_rng(3)
    Q, other = (plate.system.assembly.gather(plate.mesh.vectors.ravel()) + 0.01 * rng.standard_normal() for _ in "ab")
    Q = Q * 1.01
    expected = fresh.energy(Q)
    elements.force(other)
    assert elements.energy(Q) == expected
    elements.force(Q, ((0.5, other),))
    assert elements.energy(Q) == expected
    for _ in elements.tangent(Q):
        pass
    assert elements.energy(Q) == expected


@pytest.mark.parametrize("name", FAMILY)
def test_the_basis_is_orthonormal_and_without_the_mean_position(name):
    shape = FAMILY[name]
    T = basis(shape).T
    np.testing.assert_allclose(T @ T.T, np.eye(len(shape.kinds) - 1), rtol=0, atol=1e-15)
    shift = np.array([kind == "r" for kind in shape.kinds], dtype=float)
    np.testing.assert_allclose(T @ shift, 0.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("mirrors", "blocks"), [(NONE, 1), ((False, False, True), 2), ((True, True, True), 8)])
def test_pairs_fall_into_blocks(mirrors, blocks):
    pair = split(ENRICHED, mirrors)
    assert len(pair.blocks) == blocks
    assert 1 / blocks <= share(ENRICHED, mirrors) < 1.2 / blocks
    assert np.all(pair.first[: pair.crossed] < pair.second[: pair.crossed])
    assert np.all(pair.first[pair.crossed :] == pair.second[pair.crossed :])


def test_each_element_knows_its_mirrors():
    """3x3 elements clamped at x = 0 with free edges, then with grooves along x in the outer rows."""

    def mirrors(scene):
        plate = model(scene, (3, 3))
        mesh, stated = plate.mesh, load(scene)
        free = free_edges(mesh, held_of(stated, mesh))
        divided = ancf.system.dividing(mesh, bands_of(stated), stated.thickness, free)
        shared = sharing(mesh, divided, free, possible(mesh, (5, 5, 3)))
        cells = zip(map(tuple, mesh.corners.tolist()), shared.form_of, shared.image_of, strict=True)
        return {cell: shared.mirrors[form] for cell, form, image in cells if image == 0}

    plain, grooved = mirrors("cantilever_plain_patch"), mirrors("cantilever")
    assert plain[0, 1] == plain[1, 1] == (True, True, True)
    assert plain[0, 0] == plain[1, 0] == (True, False, True)  # its edge is y0
    assert plain[2, 0] == (False, False, True)
    assert grooved[1, 1] == (True, True, True)  # no groove
    assert grooved[1, 0] == (True, False, False)  # a groove along x beside an edge y0
    assert grooved[2, 0] == NONE  # and an edge x1


def test_portions_are_smaller_than_spans():
    """A span holds whole portions, as its tangents are handed over when the last of them is computed."""
    assert SPAN % FEWER == 0
