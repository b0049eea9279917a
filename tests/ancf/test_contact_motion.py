"""Plates that lie, bounce, slide and stick, against closed forms and what must be kept."""

import subprocess
import sys

import numpy as np
import pytest

from ancf.run import solve
from compare.result import load, save
from compare.scene import parse

WEIGHT = [{"kind": "gravity", "acceleration": [0.0, 0.0, -9.81]}]
PLANE = {"kind": "plane", "point": [0.0, 0.0, -0.025]}
MASS = 1000.0 * 0.05  # kg of the plate below
STIFF = 2e10  # Pa: the plate bends 1e-4 as much as the ground yields


def plate(obstacle=None, analysis=None, level=None, **more):
    """A square metre of plate, 0.05 m thick, 50 kg, in one element unless its level says otherwise."""
    told = {
        "name": "plate",
        "title": "plate",
        "source": "this test",
        "thickness": 0.05,
        "surface": {"kind": "rectangle", "length": 1.0, "width": 1.0},
        "material": {"kind": "svk", "youngs_modulus": STIFF, "poissons_ratio": 0.0, "density": 1000.0},
        "probes": [{"name": "C", "at": [0.5, 0.5, 0.0]}],
        "analysis": {"kind": "dynamic", "until": 1.0, "every": 0.05} | (analysis or {}),
    }
    if obstacle is not None:
        told["obstacles"] = [{"name": "ground", "shape": PLANE, "stiffness": 1e6} | obstacle]
    own = {
        "element": "conforming",
        "mesh": [1, 1],
        "points": [4, 4, 3],
        "integrator": "energy-momentum" if told["analysis"]["kind"] == "dynamic" else "trapezoidal",
        "time_step": 0.01,
    }
    told["ancf"] = {"levels": [own | (level or {})]}
    scene = parse(told | more, "test")
    return solve(scene, scene.ancf.levels[0])


def balance(result):
    """Kinetic + strain + contact + dissipated - external (t,)."""
    E = result.energies
    return E["kinetic"] + E["strain"] + E["contact"] + E["dissipated"] - E["external"]


SCHEMES = pytest.mark.parametrize("integrator", ["trapezoidal", "generalized-alpha", "energy-momentum"])
BOTH = pytest.mark.parametrize("integrator", ["trapezoidal", "energy-momentum"])


def test_a_resting_plate_presses_with_its_weight():
    result = plate(
        {},
        {"kind": "static"},
        loads=[WEIGHT[0] | {"history": [[0.0, 0.0], [1.0, 1.0]]}],
        supports=[{"kind": "hold", "corner": "x0y0", "components": ["X", "Y"]},
                  {"kind": "hold", "corner": "x1y0", "components": ["Y"]}],
    )  # fmt: skip
    assert result.status == "ok"
    np.testing.assert_allclose(result.contact.force[-1, 0], [0, 0, 9.81 * MASS], atol=1e-6)
    np.testing.assert_allclose(result.contact.pressure, 9.81 * MASS, rtol=1e-6)
    assert result.displacement[-1, 0, 2] == pytest.approx(-9.81 * MASS / 1e6, rel=1e-4)
    assert result.contact.area[-1, 0] == pytest.approx(1.0)


def thrown(c, integrator="energy-momentum", steps=400, k=1e6):
    """A stiff plate on the ground at 1 m/s downwards, no weight, for twice the half period."""
    half = np.pi / np.sqrt(k / MASS)
    return plate(
        {"stiffness": k, "damping": c},
        {"until": 2 * half, "every": 2 * half / min(steps, 100)},
        {"integrator": integrator, "time_step": 2 * half / steps},
        initial={"velocity": [0.0, 0.0, -1.0]},
    )


@SCHEMES
@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_bounce_of_a_stiff_plate(integrator, damping):
    """m z'' + c z' + k z = 0 until the force is nil: z'' = 0. damping: of the critical one."""
    w0 = np.sqrt(1e6 / MASS)
    result = thrown(2 * damping * np.sqrt(1e6 * MASS), integrator)
    decay, w = damping * w0, w0 * np.sqrt(1 - damping**2)
    parts = (np.pi + np.arctan(2 * decay * w / (decay**2 - w**2))) / w
    left = np.exp(-decay * parts) * (np.cos(w * parts) - decay / w * np.sin(w * parts))
    speed = np.diff(result.displacement[:, 0, 2])[-1] / np.diff(result.times)[-1]
    assert result.status == "ok"
    # forces of a step's end miss half of the damper's jump at the landing: 1 / 200 of the contact
    near = 2e-3 if integrator == "energy-momentum" or not damping else 0.01
    assert speed == pytest.approx(-left, rel=near)
    deepest = np.exp(-decay / w * np.arctan2(w, decay)) / w0
    assert result.displacement[:, 0, 2].min() == pytest.approx(-deepest, rel=near)
    assert np.abs(balance(result) - balance(result)[0]).max() < (1e-7 if integrator == "energy-momentum" else 0.05)


@BOTH
def test_slide_stops_after_v2_over_2_mu_g(integrator):
    """v = 1 m/s, mu = 0.5: 0.1019 m in 0.2039 s, then it stays; the ground has sunk to carry the weight."""
    sunk = 9.81 * MASS / 1e6
    result = plate(
        {"shape": PLANE | {"point": [0, 0, sunk - 0.025]}, "friction": 0.5, "stick_stiffness": 1e7, "damping": 500.0},
        {"until": 0.4, "every": 0.01},
        {"integrator": integrator, "time_step": 2.5e-3},
        loads=WEIGHT,
        initial={"velocity": [1.0, 0.0, 0.0]},
    )
    assert result.status == "ok"
    assert result.displacement[-1, 0, 0] == pytest.approx(1 / (2 * 0.5 * 9.81), rel=0.01)
    assert np.ptp(result.displacement[result.times > 0.25, 0, 0]) < 5e-4  # the springs of stick ring
    lost = result.energies["dissipated"][-1]
    assert lost == pytest.approx(MASS / 2, rel=0.01)


@pytest.mark.parametrize(("friction", "holds"), [(0.4, True), (0.35, False)])
def test_plate_on_a_slope_stays_below_its_angle_of_friction_and_slides_above(friction, holds):
    """The weight grows within 0.5 s, so that nothing jerks. Slope 0.3747: below it no creep for 10 s and friction
    carries the weight; above it a = g (sin - mu cos), which makes 7/24 a in the first second."""
    tilt, until = np.arctan(0.3747), 10.0 if holds else 1.0
    pull = 9.81 * np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    result = plate(
        {"friction": friction, "damping": 5000.0},
        {"until": until, "every": until / 20},
        {"time_step": until / 200},
        loads=[{"kind": "gravity", "acceleration": pull.tolist(), "history": [[0.0, 0.0], [0.5, 1.0]]}],
    )
    assert result.status == "ok"
    x = result.displacement[:, 0, 0]
    if holds:
        assert np.ptp(x[10:]) < 1e-9
        np.testing.assert_allclose(result.contact.force[-1, 0], -MASS * pull, atol=1e-3)
    else:
        assert x[-1] == pytest.approx(7 / 24 * 9.81 * (np.sin(tilt) - friction * np.cos(tilt)), rel=0.01)


def test_rigid_plate_on_a_ball_and_on_a_drum():
    """A bed of springs pressed to the depth d by a shape r^2/(2 R): pi k R d^2 on a ball, (4/3) k sqrt(2 R) d^1.5 a
    metre on a drum; exact where d is small beside R. The plate is held, and the body 1 mm inside it."""
    depth, radius, k = 1e-3, 20.0, 1e8
    held = [{"kind": "hold", "whole": True, "components": ["X", "Y", "Z"]}]
    top = [0.5, 0.5, -0.025 + depth - radius]
    ball, drum = {"kind": "sphere", "centre": top}, {"kind": "drum", "point": top, "axis": [0, 2, 0]}
    for shape, force in (
        (ball, np.pi * k * radius * depth**2),
        (drum, 4 / 3 * k * np.sqrt(2 * radius) * depth**1.5),
    ):
        result = plate(
            {"shape": shape | {"radius": radius}, "stiffness": k},
            {"kind": "static", "every": 1.0},
            {"points": [40, 40, 2], "time_step": 1.0},
            supports=held,
        )
        assert result.contact.force[-1, 0, 2] == pytest.approx(force, rel=0.01)  # 40 points a side, 16 inside


def test_statics_begins_in_balance_with_what_the_plate_lies_in():
    """Clamped at one edge, 10 mm inside a ball: pushed out of it before any load acts, as it is at the end."""
    result = plate(
        {"shape": {"kind": "sphere", "centre": [1.0, 0.5, -1.015], "radius": 1.0}},
        {"kind": "static", "every": 1.0},
        {"mesh": [2, 2], "time_step": 1.0},
        supports=[{"kind": "clamp", "edge": "x0"}],
        material={"kind": "svk", "youngs_modulus": 1e7, "poissons_ratio": 0.0},
    )
    first, last = result.contact.force[:, 0, 2]
    assert result.status == "ok" and first == pytest.approx(last, rel=1e-6) and last > 1.0
    np.testing.assert_allclose(result.displacement[0], result.displacement[1], rtol=1e-6)


def test_flying_plate_keeps_its_angular_momentum_about_a_smooth_ball():
    """Forces along the mean normals have no moment about the centre: the axis of the ball's centre and any spin."""
    centre = np.array([0.3, 0.4, -0.6])
    result = plate(
        {"shape": {"kind": "sphere", "centre": centre.tolist(), "radius": 0.5}, "stiffness": 1e7},
        {"until": 0.3, "every": 0.01},
        initial={"velocity": [0.2, 0.1, -2.0], "angular_velocity": [0.5, -1.0, 2.0]},
        material={"kind": "svk", "youngs_modulus": 2e6, "poissons_ratio": 0.3, "density": 1000.0},
    )
    assert result.contact.force[:, 0, 2].max() > 100
    np.testing.assert_allclose(balance(result), balance(result)[0], rtol=1e-10)


def test_edge_on_landing_keeps_its_energy():
    """A soft plate whose ground stands 60 degrees askew: an edge lands first."""
    tilt = np.radians(60)
    result = plate(
        {"shape": {"kind": "plane", "point": [-0.02, 0, 0], "normal": [np.sin(tilt), 0.0, np.cos(tilt)]},
         "stiffness": 1e7, "damping": 100.0, "friction": 0.3},
        {"until": 0.5, "every": 0.01},
        {"mesh": [2, 2], "time_step": 2e-3},
        initial={"velocity": [-2 * np.sin(tilt), 0.0, -2 * np.cos(tilt)]},
        material={"kind": "svk", "youngs_modulus": 2e6, "poissons_ratio": 0.3, "density": 1000.0},
    )  # fmt: skip
    assert result.status == "ok"
    assert result.contact.area.max() < 0.5
    assert np.linalg.norm(result.contact.force, axis=2).max() > 100
    np.testing.assert_allclose(balance(result), balance(result)[0], rtol=1e-9)


def test_impulse_of_the_contact_is_the_change_of_momentum():
    """Forces are means over a step: their sum times dt is the momentum gained, whatever the plate does."""
    result = plate(
        {"damping": 200.0, "friction": 0.4, "stiffness": 1e7},
        {"until": 0.1, "every": 1e-3},
        {"time_step": 1e-3},
        initial={"velocity": [1.0, 0.0, -2.0]},
        probes=[{"name": "all", "region": [[0.0, 1.0], [0.0, 1.0]]}],
    )
    v = 2 * np.diff(result.displacement[:, 0], axis=0) / 1e-3
    ends = [np.array([1.0, 0.0, -2.0])]
    for mean in v:  # q1 - q0 = dt (v0 + v1) / 2
        ends.append(mean - ends[-1])
    gained = MASS * (ends[-1] - ends[0])
    np.testing.assert_allclose(result.contact.force[1:, 0].sum(axis=0) * 1e-3, gained, atol=1e-6)


def test_landing_on_a_linear_director():
    """The paper's element carries no wave through its thickness: its director is one linear bar element, which on
    rigid ground leaves after half a period of sqrt(3) c / L: pi / sqrt(3) L / c, where a solid takes 2 L / c. Its end
    has a quarter of the mass; the ground's damper takes the energy of that, as a plastic impact would."""
    L, c = 0.05, np.sqrt(2e6 / 1000.0)
    contact, stiffness = np.pi / np.sqrt(3) * L / c, 1e3 * 2e6 / L
    result = plate(
        {"stiffness": stiffness, "damping": np.sqrt(stiffness * MASS)},
        {"until": 1.25 * contact, "every": contact / 200},
        {"time_step": contact / 200},
        initial={"velocity": [0.0, 0.0, -0.01]},
        material={"kind": "svk", "youngs_modulus": 2e6, "poissons_ratio": 0.0, "density": 1000.0},
    )
    touches = np.flatnonzero(result.contact.force[:, 0, 2] > 0)
    assert result.times[touches[-1]] == pytest.approx(contact, rel=0.01)
    speed = np.diff(result.displacement[-2:, 0, 2])[0] / np.diff(result.times[-2:])[0]
    assert speed == pytest.approx(0.75 * 0.01, rel=0.01)  # 3/2 v after the landing, half the mass moves


def test_steps_too_long_for_a_stiff_contact_end_under_their_name():
    result = thrown(0.0, "trapezoidal", steps=5, k=1e6)
    assert result.status == "energy_not_kept"
    assert "too long" in result.message
    assert np.all(np.isfinite(result.displacement))


def test_a_result_with_contact_is_read_back(tmp_path):
    result = thrown(0.0, steps=100)
    save(result, tmp_path / "result.npz")
    again = load(tmp_path / "result.npz")
    for name in ("force", "area", "points", "share", "pressure"):
        np.testing.assert_array_equal(getattr(again.contact, name), getattr(result.contact, name))


def test_a_plate_without_obstacles_loads_no_code_of_contact():
    script = """
import sys
sys.path.insert(0, "tests/ancf")
from test_contact_motion import plate
assert plate(analysis={"until": 0.1}).contact is None
assert not {"ancf.contact", "ancf.contact_law", "ancf.face", "ancf.obstacle"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)
