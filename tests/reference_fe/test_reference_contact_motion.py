"""Scenes with obstacles against closed forms: rest, bounce, slide, stick, an elastic bar, Hertz."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compare import result as results
from compare.scene import parse
from reference_fe import statics
from reference_fe.contact import Contact, Law, Obstacle, face, sphere
from reference_fe.elasticity import lame, pattern, tabulate
from reference_fe.geometry import Plate
from reference_fe.mesh import Spacing, make
from reference_fe.run import solve
from reference_fe.system import assemble

MASS = 500.0  # kg of the block: 1 m x 1 m x 0.5 m


def block(height=-0.25, law=None, gravity=None, velocity=None, until=0.1, every=0.1, step=1e-3, **changes):
    """A stiff block on a plane at this height."""
    scene = {
        "name": "block",
        "title": "block",
        "surface": {"kind": "rectangle", "length": 1.0, "width": 1.0},
        "thickness": 0.5,
        "material": {"kind": "svk", "youngs_modulus": 1e10, "density": 1000.0},
        "obstacles": [{"name": "ground", "shape": {"kind": "plane", "point": [0.0, 0.0, height]}, **law}],
        "probes": [{"name": "P", "at": [0.5, 0.5, 0.0]}],
        "analysis": {"kind": "dynamic", "until": until, "every": every},
        "reference": {"levels": [{"size": 0.5, "time_step": step}]},
    }
    if gravity is not None:
        scene["loads"] = [{"kind": "gravity", "acceleration": gravity}]
    if velocity is not None:
        scene["initial"] = {"velocity": velocity}
    return parse({**scene, **changes}, "test")


def solved(scene, **level):
    result = solve(scene, scene.reference.levels[0].model_copy(update=level))
    assert result.status == "ok", result.message
    return result


def drift(result) -> float:
    """Change (J) of the sum that should be constant."""
    e = result.energies
    return float(np.ptp(e["kinetic"] + e["strain"] + e["contact"] - e["external"] + e["dissipated"]))


def test_a_resting_block_is_carried_by_its_weight_without_creep():
    """Set down on a slope that it sticks to, damped well: ten seconds later nothing has moved any more.

    The slope is gravity's: 20 degrees against a friction of 0.5, tan 20 degrees = 0.36.
    """
    gravity = [10 * math.sin(math.radians(20)), 0.0, -10 * math.cos(math.radians(20))]
    law = {"stiffness": 1e7, "damping": 1e5, "friction": 0.5}
    start = block(law=law, gravity=gravity, until=10.0, every=5.0, step=0.02)
    result = solved(start, integrator="generalized-alpha")  # no damper reaches what rings inside the block
    assert np.allclose(result.contact.force[-1, 0], -MASS * np.array(gravity), rtol=1e-4, atol=0.1)
    assert result.contact.area[-1, 0] == pytest.approx(1.0)
    assert np.abs(result.displacement[2] - result.displacement[1]).max() < 1e-8
    assert result.displacement[-1, 0, 2] == pytest.approx(MASS * gravity[2] / 1e7, rel=1e-3)


@pytest.mark.parametrize("integrator", ["trapezoidal", "generalized-alpha"])
def test_a_damped_bounce_is_that_of_a_mass_on_a_spring(integrator):
    """m d'' + c d' + k d = 0 from the speed V until k d + c d' = 0, where a damper that may not pull lets go."""
    V, k, c = 1.0, 1e6, 5e3
    law = {"stiffness": k, "damping": c}
    result = solved(block(law=law, velocity=[0.0, 0.0, -V], until=0.2, every=0.002), integrator=integrator)
    omega, zeta = math.sqrt(k / MASS), c / (2 * math.sqrt(k * MASS))
    own = math.sqrt(1 - zeta**2)
    angle = math.atan2(-2 * zeta * own, 1 - 2 * zeta**2) % math.pi  # own frequency x time of release
    speed = -V * math.exp(-zeta * angle / own) * (math.cos(angle) - zeta / own * math.sin(angle))
    turn = math.atan2(own, zeta)
    deepest = V / (omega * own) * math.exp(-zeta * turn / own) * math.sin(turn)
    assert math.sqrt(2 * result.energies["kinetic"][-1] / MASS) == pytest.approx(speed, rel=2e-3)
    assert -result.displacement[:, 0, 2].min() == pytest.approx(deepest, rel=2e-3)
    assert result.energies["dissipated"][-1] == pytest.approx(0.5 * MASS * (V**2 - speed**2), rel=5e-3)
    assert (np.diff(result.energies["dissipated"]) >= 0).all()
    assert drift(result) < (1e-5 if integrator == "trapezoidal" else 2e-3) * 0.5 * MASS * V**2


def test_a_sliding_block_stops_where_friction_has_taken_its_energy():
    """After v² / (2 mu g); the sticking spring gives a little, mu g rho t / k_s = 1.5e-4 m."""
    g, mu, k = 10.0, 0.3, 1e7
    law = {"stiffness": k, "damping": 1e4, "friction": mu}
    start = block(-0.25 + MASS * g / k, law, [0.0, 0.0, -g], [2.0, 0.0, 0.0], until=1.0, every=0.1, step=4e-3)
    result = solved(start)
    path = result.displacement[:, 0, 0]
    t = result.times[result.times < 2.0 / (mu * g)]
    assert np.allclose(path[: t.size], 2.0 * t - 0.5 * mu * g * t**2, atol=2e-3)
    assert path[-1] == pytest.approx(2.0**2 / (2 * mu * g), rel=1e-3) and abs(path[-1] - path[-3]) < 5e-4
    assert result.energies["dissipated"][-1] == pytest.approx(0.5 * MASS * 2.0**2, rel=2e-3)
    assert drift(result) < 1e-6 * 0.5 * MASS * 2.0**2


def bar(integrator):
    """A bar 1 m long, waves of 1000 m/s in it, that meets a wall a hundred times stiffer than its elements."""
    scene = block(
        -0.5,
        {"stiffness": 1e12},
        velocity=[0.0, 0.0, -1.0],
        until=2.5e-3,
        every=1e-5,
        step=1e-5,
        surface={"kind": "rectangle", "length": 0.1, "width": 0.1},
        thickness=1.0,
        material={"kind": "svk", "youngs_modulus": 1e9, "density": 1000.0},
        probes=[{"name": "P", "at": [0.05, 0.05, 0.0]}],
    )
    return solved(scene, size=0.1, integrator=integrator)


@pytest.mark.slow
def test_an_elastic_bar_leaves_after_a_wave_has_run_forth_and_back():
    """Contact lasts 2 L / c = 2 ms at the force rho c V A = 10 kN; generalized-alpha calms the waves of the mesh."""
    result = bar("generalized-alpha")
    force = result.contact.force[:, 0, 2]
    assert result.times[np.flatnonzero(force > 500.0)[-1]] == pytest.approx(2e-3, rel=1e-2)
    assert np.trapezoid(force, result.times) / 2e-3 == pytest.approx(1e4, rel=1e-2)
    assert 0 < drift(result) < 1e-2 * 5.0  # J; the scheme's own damping of what the mesh cannot carry
    assert drift(bar("trapezoidal")) < 1e-4 * 5.0


@pytest.mark.slow
def test_hertz_sphere_on_a_thick_block(radius=0.4, side=1.0, k=3e10, young=1e6, poisson=0.3):
    """F = 4/3 E* sqrt(R) d^1.5 on a quarter of a block 50 times wider than the contact, which is 4 elements wide."""
    near, deep = (0.0, 0.03), (side / 2 - 0.02, side / 2)
    solid = make(Plate(side, side, side), Spacing(side / 4, ((0.0132, side, near, near, deep),)))
    x, y, z = solid.box.doflocs
    held = np.zeros((x.size, 3), dtype=bool)
    held[x == 0, 0] = held[y == 0, 1] = held[z < 1e-9 - side / 2] = True
    table = tabulate(solid, 4)
    where = pattern(table.nodes, held.all(axis=1))
    system = assemble(table, lame(young, poisson), where, None, lambda time: np.zeros((x.size, 3)), 1e-6, held)
    state, memory, top = statics.begin(system), system.memory(), face(solid, where, 1)
    for depth in (1.25e-4, 2.5e-4):
        ball = Obstacle(sphere([0.0, 0.0, side / 2 + radius - depth], radius), Law(k), top)
        system = replace(system, contact=Contact((ball,), 1e-9))
        state = replace(state, touch=system.contact.begin(system.expand(state.u)))
        state = statics.balance(system, state, depth, memory)
    force = system.contact.force_now(state.touch, system.expand(state.u), np.zeros((x.size, 3)))[:, 2].sum()
    assert -4 * force == pytest.approx(4 / 3 * young / (1 - poisson**2) * radius**0.5 * 2.5e-4**1.5, rel=1e-2)


@pytest.mark.parametrize(
    ("stiffness", "step"),
    [
        (1e5, 1e-5),
        (1e5, 1e-2),
        (1e7, 1e-5),
        (1e7, 1e-2),
        (1e11, 1e-5),
        pytest.param(1e9, 1e-2, marks=pytest.mark.slow),
        pytest.param(1e11, 1e-2, marks=pytest.mark.slow),
    ],
)
def test_no_stiffness_or_step_ends_in_a_gain_of_energy(stiffness, step):
    """A soft block thrown askew onto ground of 1e-2 to 1e4 times 1e7 N/m3, all points at once, sliding and damped.

    What is left at long steps is the trapezoidal rule's own error in the block, whose waves cross it in 5 ms.
    """
    law = {"stiffness": stiffness, "damping": 1e-3 * stiffness if stiffness < 1e8 else 0.0, "friction": 0.5}
    soft = {"kind": "svk", "youngs_modulus": 1e7, "poissons_ratio": 0.3, "density": 1000.0}
    start = block(-0.25 - 2 * step, law, [0.0, 0.0, -10.0], [0.5, 0.0, -1.0], 20 * step, 10 * step, step, material=soft)
    result = solve(start, start.reference.levels[0])
    assert result.status in ("ok", "newton_diverged", "inverted")
    assert np.isfinite(result.displacement).all() and np.isfinite(result.contact.force).all()
    assert drift(result) < 0.02 * 0.5 * MASS * 1.25


def test_statics_presses_a_block_that_just_touches(tmp_path):
    """Under its weight on a soft ground: the reaction is the weight; the result keeps what contact did."""
    holds = [{"kind": "hold", "whole": True, "components": ["X", "Y"]}]
    scene = block(
        law={"stiffness": 1e6}, gravity=[0.0, 0.0, -10.0], supports=holds,
        analysis={"kind": "static", "until": 1.0, "every": 1.0}, step=1.0,
    )  # fmt: skip
    result = solved(scene)
    assert np.allclose(result.contact.force[-1, 0], [0.0, 0.0, 5000.0], rtol=1e-9, atol=1e-6)
    assert result.displacement[-1, 0, 2] == pytest.approx(-5000.0 / 1e6, rel=1e-4)
    assert result.contact.pressure @ result.contact.share == pytest.approx(5000.0, rel=1e-9)
    assert np.allclose(result.contact.points[:, 2], -0.25) and result.contact.share.sum() == pytest.approx(1.0)
    results.save(result, tmp_path / "result.npz")
    assert np.array_equal(results.load(tmp_path / "result.npz").contact.force, result.contact.force)


def test_a_scene_without_obstacles_imports_no_contact():
    script = """
from plate_scene import PLAIN
from compare.scene import ReferenceLevel, parse
from reference_fe.run import solve
import sys
result = solve(parse({**PLAIN, "analysis": {"kind": "dynamic", "until": 0.2, "every": 0.1}}, "test"),
               ReferenceLevel(size=0.5, time_step=0.1))
assert result.status == "ok" and result.contact is None and "contact" not in result.energies
print([name for name in sys.modules if name.startswith("reference_fe") and ("contact" in name or "obstacle" in name)])
"""
    path = [*sys.path, str(Path(__file__).parent)]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:] = {path!r}\n{script}"], capture_output=True, text=True
    )
    assert done.stdout.strip() == "[]", done.stderr
