"""Plates and rings on a rigid rim, and what each solver must find of them alone, in closed form.

`solve` is a solver's, `solver` its name in a scene. All are coarse: what is checked holds on any mesh.
"""

import math

import numpy as np
import pytest

from compare.scene import Scene, parse
from tests.revolved_scenes import cylinder, scene_of

LENGTH, WIDTH, HEIGHT, E, RHO = 1.0, 0.5, 0.1, 2e6, 1000.0
MASS = LENGTH * WIDTH * HEIGHT * RHO
RAMP = [[0.0, 0.0], [1.0, 1.0]]
G = 9.81


def strip(solver: str, rim: dict, **more) -> Scene:
    """A strip without Poisson's effect."""
    levels = {"ancf": {"mesh": [3, 2], "time_step": 0.25}, "reference": {"size": 0.4, "time_step": 0.25}}
    data = {
        "name": "strip",
        "title": "Strip on a rim",
        "surface": {"kind": "rectangle", "length": LENGTH, "width": WIDTH},
        "thickness": HEIGHT,
        "material": {"kind": "svk", "youngs_modulus": E, "density": RHO},
        "rim": rim,
        "probes": [{"name": "free end", "at": [LENGTH, WIDTH / 2, 0.0]}],
        "analysis": {"kind": "static", "until": 1.0, "every": 0.25},
        solver: {"levels": [levels[solver]]},
    }
    return parse(data | more, "strip.toml")


def solved(solve, solver: str, scene: Scene):
    """The result at the only level; it must have ended well."""
    result = solve(scene, scene.ladder(solver)[0])
    assert result.status == "ok", result.message
    return result


def stretching_force(e: float) -> float:
    """Force (N) that stretches the strip by the part e: St. Venant-Kirchhoff, S = E (e + e^2 / 2), P = (1 + e) S."""
    return WIDTH * HEIGHT * E * (1 + e) * (e + e**2 / 2)


def a_moved_rim_carries_the_plate(solve, solver):
    """A rim that is moved takes an unloaded plate along rigidly, and nothing is needed to keep it there."""
    rim = {"edges": ["x0"], "displacement": [0.02, -0.1, 0.3], "history": RAMP}
    result = solved(solve, solver, strip(solver, rim))
    np.testing.assert_allclose(result.displacement[:, 0], np.outer(result.times, rim["displacement"]), atol=1e-9)
    np.testing.assert_allclose(result.rim.displacement, np.outer(result.times, rim["displacement"]), atol=1e-12)
    assert np.abs(result.rim.force).max() < 1e-5 * stretching_force(0.1)  # a nodal position is known to 1e-9 m or so


def load_and_way_of_a_free_rim_belong_together(solve, solver):
    """Uniform stretch, which both fields contain: a load on the rim moves it by e, and e needs that load; its work is
    the strain energy where the load rises slowly (by quarters: to the trapezoidal rule's error)."""
    e = 0.1
    held = {"supports": [{"kind": "clamp", "edge": "x0"}]}
    load = {"kind": "axle", "force": [stretching_force(e), 0.0, 0.0], "history": RAMP}
    free = solved(solve, solver, strip(solver, {"edges": ["x1"], "free": ["X"]}, loads=[load], **held))
    assert free.rim.displacement[-1, 0] == pytest.approx(e * LENGTH, rel=1e-7)
    assert np.abs(free.rim.force[:, 0]).max() < 1e-6 * stretching_force(e)
    way = {"edges": ["x1"], "displacement": [e * LENGTH, 0.0, 0.0], "history": RAMP}
    moved = solved(solve, solver, strip(solver, way, **held))
    expected = [stretching_force(e * t) for t in moved.times]
    np.testing.assert_allclose(moved.rim.force[:, 0], expected, rtol=1e-7, atol=1e-7 * expected[-1])
    energy = LENGTH * WIDTH * HEIGHT * E / 2 * (e + e**2 / 2) ** 2
    for result in (free, moved):
        assert result.energies["strain"][-1] == pytest.approx(energy, rel=1e-6)
        assert result.energies["external"][-1] == pytest.approx(energy, rel=4e-3)
    assert moved.unknowns < free.unknowns  # by the one that is free


def a_rim_bears_what_hangs_on_it(solve, solver):
    """Force and moment about the origin of the weight of plate and rim, exactly those of the deformed plate."""
    rim = {"edges": ["x0"], "mass": 7.0}
    weight = {"kind": "gravity", "acceleration": [0.0, 0.0, -G / 20]}
    result = solved(solve, solver, strip(solver, rim, loads=[weight]))
    np.testing.assert_allclose(result.rim.force[-1], [0.0, 0.0, (MASS + 7.0) * G / 20], rtol=1e-6, atol=1e-4)
    arm = result.rim.moment[-1, 1] / -(MASS * G / 20)  # of the plate alone: the rim's own weight is at its edge, x = 0
    assert 0.45 * LENGTH < arm <= 0.5 * LENGTH + 1e-9  # bent down, the plate is nearer to the rim
    assert result.displacement[-1, 0, 2] < -0.01


def a_heavy_rim_is_thrown_and_falls(solve, solver):
    """Free along Z: rim and plate fall with g whatever the rim weighs, and keep the energy."""
    rim = {"edges": ["x0"], "free": ["Z"], "mass": 3 * MASS}
    motion = {"initial": {"velocity": [0.0, 0.0, 2.0]}, "analysis": {"kind": "dynamic", "until": 0.5, "every": 0.25}}
    weight = {"kind": "gravity", "acceleration": [0.0, 0.0, -G]}
    result = solved(solve, solver, strip(solver, rim, loads=[weight], **motion))
    expected = 2.0 * result.times - G / 2 * result.times**2
    np.testing.assert_allclose(result.rim.displacement[:, 2], expected, atol=1e-7)
    np.testing.assert_allclose(result.displacement[:, 0, 2], expected, atol=1e-6)
    total = result.energies["kinetic"] - result.energies["external"]
    np.testing.assert_allclose(total, 0.5 * 4 * MASS * 2.0**2, rtol=1e-7)


SPIN, PUSH, RIM_MASS, UNTIL = 6.0, 400.0, 20.0, 0.5


def spinning_ring(solver: str) -> Scene:
    """A stiff ring of radius 1 m that is thrown along X, spins, and is pushed along Z."""
    levels = {"ancf": {"mesh": [8, 2], "time_step": 0.01}, "reference": {"size": 0.5, "time_step": 0.01}}
    return scene_of(
        cylinder(1.0, 0.4),
        material={"kind": "svk", "youngs_modulus": 2e9, "poissons_ratio": 0.3, "density": RHO},
        rim={"edges": ["y0", "y1"], "free": ["X", "Z"], "mass": RIM_MASS, "spin": [0.0, SPIN, 0.0]},
        initial={"velocity": [0.5, 0.0, 0.0], "angular_velocity": [0.0, SPIN, 0.0]},
        loads=[{"kind": "axle", "force": [0.0, 0.0, PUSH]}],
        probes=[{"name": "top", "at": [0.0, 0.5, 0.0]}],
        analysis={"kind": "dynamic", "until": UNTIL, "every": 0.1},
        **{"ancf": None, "reference": None, solver: {"levels": [levels[solver]]}},
    )


def a_spinning_ring_flies_and_keeps_its_energy(solve, solver):
    """A stiff ring whose rim spins and is pushed along X and Z: the rim's place is that of a mass, the ring stays
    round, kinetic energy is that of the spin and of the flight, and no work is lost."""
    result = solved(solve, solver, spinning_ring(solver))
    mass = result.facts["mass"] + RIM_MASS
    expected = np.column_stack([0.5 * result.times, 0 * result.times, PUSH / mass * result.times**2 / 2])
    # 1e-4 m of 0.2 m: the solid's coarse mesh is not alike all around, so that its centre is off the axle a little
    np.testing.assert_allclose(result.rim.displacement, expected, atol=1e-4)
    place, turn = result.position("top") - result.rim.displacement, SPIN * result.times
    on_circle = np.column_stack([np.sin(turn), 0 * turn, np.cos(turn)])
    np.testing.assert_allclose(place, on_circle, atol=2e-4)  # centrifugal strain: rho (spin R)^2 / E = 2e-5
    area = math.pi * ((1.05**4) - (0.95**4)) / 2 * 0.4 * RHO  # moment of inertia about the axle
    speed = np.array([0.5, 0.0, PUSH / mass * UNTIL])
    kinetic = area * SPIN**2 / 2 + mass / 2 * speed @ speed
    assert result.energies["kinetic"][-1] == pytest.approx(kinetic, rel=5e-3)  # the solid's facets are chords
    total = result.energies["kinetic"] + result.energies["strain"] - result.energies["external"]
    np.testing.assert_allclose(total, total[0], rtol=5e-4)  # the trapezoidal rule's error of the spin


CASES = (
    a_moved_rim_carries_the_plate,
    load_and_way_of_a_free_rim_belong_together,
    a_rim_bears_what_hangs_on_it,
    a_heavy_rim_is_thrown_and_falls,
    a_spinning_ring_flies_and_keeps_its_energy,
)
