"""The speed gate that no busy machine can upset: counts of operations, arrays, factorisations and iterations.

Times are compared once, as a ratio against a matrix product in the same process, with a wide margin.
"""

import tracemalloc

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import ancf.run
import ancf.split_form
import ancf.system
import ancf.unpack
import reference_fe.run
import reference_fe.unpack
from ancf.linear_solver import LinearSolver
from ancf.packing import PORTION
from compare.scene import AncfLevel, ReferenceLevel, load
from reference_fe import linear_solver
from reports import speed_runs
from reports.timing import least

STEP = 0.01
HALF = {"analysis.until": 0.5}


def level(mesh, points=(3, 3, 2), time_step=STEP):
    return AncfLevel(element="conforming", mesh=(mesh, mesh), points=points, time_step=time_step)


@pytest.fixture(scope="module")
def plates():
    """Models of 16x16 elements without and with the two grooves of Table 5."""
    return {name: ancf.unpack.build(load(name), level(16)) for name in ("cantilever_plain", "cantilever")}


def elements(model):
    return model.body.elements


def nodal(model):
    vectors = model.mesh.vectors + 1e-3 * np.random.default_rng(0).standard_normal(model.mesh.vectors.shape)
    return vectors.ravel(), vectors[model.body.connectivity]


def test_equal_elements_share_one_tensor(plates):
    """Plain: 1. Two straight grooves from 0.2 to 0.3 and 0.7 to 0.8 on lines 1/16 apart: two cut columns each, and
    the plain one; both grooves cut alike, so at most 1 + 4 tensors for 256 elements."""
    assert len(elements(plates["cantilever_plain"]).stress) == 1
    assert 2 <= len(elements(plates["cantilever"]).stress) <= 5


def test_a_groove_adds_no_operation(plates):
    """Every element goes through one product with a tensor of the same size, whatever was integrated into it."""
    plain, grooved = (elements(model) for model in plates.values())
    for name in ("stress", "symmetric", "antisymmetric"):
        assert getattr(plain, name).shape[1:] == getattr(grooved, name).shape[1:]
    assert len(plain.form_of) == len(grooved.form_of)


def test_equal_elements_go_through_few_products(plates):
    """A portion without grooves takes three products: P, the symmetric and the antisymmetric part."""
    products = {name: [len(p.stress) + len(p.tangent) for p in elements(plates[name])._portions] for name in plates}
    assert products["cantilever_plain"] == [3] * (256 // PORTION)
    forms = len(elements(plates["cantilever"]).stress)
    assert sum(products["cantilever"]) <= 3 * (256 // PORTION + forms - 1)  # a form begins once, or with a portion


def test_images_halve_the_forms_of_a_plate_with_free_edges():
    """3x3 enriched elements, clamped on one side: inside, on an edge, in a corner; without images six."""
    assert sorted(np.bincount(elements(patch(3)).form_of)) == [2, 2, 5]


def test_mirrors_leave_a_quarter_of_the_tensors():
    """The 276 pairs of 23 functions in 8 blocks inside (three mirrors), 4 on an edge, 2 in a corner; two elements have
    an eighth of all entries, five a quarter and two a half, were the blocks equal: 0.28; they are so to a tenth."""
    split = elements(patch(3))
    assert sorted(len(form.stress) for form in split.forms) == [2, 4, 8]
    entries = np.array([sum(block.size for block in form.stress) for form in split.forms])[split.form_of]
    ideal = (2 / 8 + 5 / 4 + 2 / 2) / 9
    assert ideal < entries.mean() / 276**2 < 1.1 * ideal


def patch(mesh):
    ours = AncfLevel(mesh=(mesh, mesh), points=(5, 5, 3), time_step=0.02)
    return ancf.unpack.build(load("cantilever_plain_patch"), ours)


def test_a_tangent_and_an_energy_where_the_force_was_computed_spare_the_stress(monkeypatch):
    """14 products of a force; the tangent adds its own 28 and the energy none."""
    model, calls = patch(3), counted(monkeypatch, ancf.split_form.np, "matmul")
    split, q = elements(model), model.mesh.vectors.ravel() * 1.01
    Q, seen = model.system.assembly.gather(q), []
    for evaluate in (split.force, lambda Q: spend(split.tangent(Q)), split.force, split.energy, split.energy):
        before = len(calls)
        evaluate(Q)
        seen.append(len(calls) - before)
    stress, rest = 14, 4
    assert seen[0] == stress + rest and seen[1] == 28 + 2 and seen[2] == 2 and seen[3:] == [0, 0]


def flops(quadratic):
    """Multiplications and additions of the three products of one tangent: P, six symmetric and three odd parts."""
    sizes = {name: np.prod(getattr(quadratic, name).shape[1:]) for name in ("stress", "symmetric", "antisymmetric")}
    return 2 * int(sizes["stress"] + 6 * sizes["symmetric"] + 3 * sizes["antisymmetric"])


def test_a_tangent_takes_a_third_of_a_million_operations(plates):
    """Symmetric storage of 136 x 136 pairs would take 0.37 million in the products; see quadratic_form."""
    assert flops(elements(plates["cantilever_plain"])) <= 320_000


@pytest.mark.parametrize("name", ["cantilever_plain", "cantilever"])
def test_evaluation_allocates_no_large_temporaries(plates, name):
    """Beyond its result a force takes 64 kB; all tangents together take less than one portion of them."""
    quadratic, (_, Q) = elements(plates[name]), nodal(plates[name])
    portion = 8 * PORTION * (6 * 136 + 3 * 120)
    for evaluate, bound in ((quadratic.force, Q.nbytes + 64_000), (lambda Q: spend(quadratic.tangent(Q)), portion)):
        evaluate(Q)  # the work arrays are made once
        assert peak_of(lambda f=evaluate: f(Q)) <= bound


def spend(spans):
    for _ in spans:
        pass


def peak_of(call):
    """Largest number of bytes that a call holds at once beyond what was there before."""
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        call()
        return tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()


def test_steps_do_not_grow(plates):
    """One step holds two matrices in band storage at most and what vectors it needs; nothing stays behind it."""
    from ancf.integrate import SCHEMES, advance, initial_state

    model = plates["cantilever_plain"]
    system, solver = model.system, LinearSolver(model.system.assembly.pattern)
    q = model.mesh.vectors.ravel().copy()
    state = initial_state(system, solver, q, np.zeros_like(q))
    motion = advance(system, solver, SCHEMES["trapezoidal"], state, 2 * STEP, STEP, None)
    band = 8 * (solver.bandwidth + 1) * system.unknowns
    kept = []
    tracemalloc.start()
    try:
        for k in range(3, 9):
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            motion = advance(system, solver, SCHEMES["trapezoidal"], motion.state, k * STEP, STEP, motion.factor)
            now, peak = tracemalloc.get_traced_memory()
            assert peak - before <= 2 * band + 4_000_000
            kept.append(now)
    finally:
        tracemalloc.stop()
    assert max(kept) - kept[0] <= band + 100_000  # a new factor may replace one that was made before tracing began


def counted(monkeypatch, owner, name):
    """Count the calls of owner.name from here on."""
    calls, original = [], getattr(owner, name)

    def wrapper(*arguments, **keywords):
        calls.append(arguments)
        return original(*arguments, **keywords)

    monkeypatch.setattr(owner, name, wrapper)
    return calls


def test_ancf_sets_up_once_and_factorises_seldom(monkeypatch):
    """50 steps of the grooved 8x8 cantilever. Plain Newton would take 3 to 4 factorisations a step, 150 in all;
    factors that are kept but not corrected take 21 or more."""
    patterns = counted(monkeypatch, ancf.system, "assembly")
    tensors = counted(monkeypatch, ancf.system, "quadratic_form")
    result = ancf.run.solve(load("cantilever").override(HALF), level(8))
    assert result.status == "ok" and result.steps == 50
    assert len(patterns) == 1
    assert len(tensors) == result.facts["distinct_elements"] <= 5
    assert result.facts["factorisations"] <= 18
    assert result.newton_iterations <= 275


def test_the_reference_analyses_once_and_factorises_seldom(monkeypatch):
    """25 steps of a coarse mesh. Plain Newton would take 4 to 5 factorisations a step, about 110 in all."""
    try:
        phases = counted(monkeypatch, linear_solver.Pardiso, "_call")
        linear_solver.Pardiso(np.array([0, 1]), np.array([0]))
    except ImportError:
        phases = None
    systems = counted(monkeypatch, reference_fe.unpack, "pattern")
    scene = load("cantilever_plain").override(HALF)
    result = reference_fe.run.solve(scene, ReferenceLevel(size=0.5, time_step=0.02))
    assert result.status == "ok" and result.steps == 25
    assert len(systems) == 1
    assert result.facts["factorisations"] <= 0.6 * result.steps
    assert result.newton_iterations <= 10 * result.steps
    if phases is not None:
        kinds = [arguments[1] for arguments in phases]
        assert kinds.count(11) == len({id(arguments[0]) for arguments in phases}) <= 2  # the mass has its own
        assert kinds.count(22) <= result.facts["factorisations"] + 1


@pytest.mark.parametrize("name", ["cantilever_plain", "cantilever"])
def test_a_tangent_costs_a_few_matrix_products_of_its_size(plates, name):
    """Measured 1.5 to 2.5 times a BLAS product with as many operations; 10 leaves room for any machine."""
    model = plates[name]
    quadratic, (_, Q) = elements(model), nodal(model)
    side = 400
    matrix = np.random.default_rng(0).standard_normal((side, side))
    with threadpool_limits(1, user_api="blas"):  # as in a solve: on busy cores threads of one product spin
        product = least(lambda: matrix @ matrix, 15) / (2 * side**3)
        tangent = least(lambda: spend(quadratic.tangent(Q)), 15) / (flops(quadratic) * len(Q))
    assert tangent <= 10 * product


def test_the_ladder_of_enriched_elements_has_points_enough():
    """A fiftieth of a thousandth of the height: what `reports.speed_runs` says of 5x5x3 points."""
    heights = []
    for points in (speed_runs.ENOUGH, speed_runs.EXACT):
        found = speed_runs.ancf(speed_runs.PATCH, 2, 0.02, points, element="enriched")
        heights.append(found["height"])
    assert heights[0] == pytest.approx(heights[1], rel=2e-5) and heights[0] != heights[1]
