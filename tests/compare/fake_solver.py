"""A solver with a known answer, for tests of everything around solvers: z of P = -0.5 - E/1e9 (1 + h^2)."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from compare.result import Result
from compare.scene import load

FAKE = {"ancf": "fake_solver", "reference": "fake_solver"}


def small(meshes=(2,), sizes=(), **changes):
    """The cantilever with few levels and no sensitivity."""
    stated = {
        "ancf": {"time_step": 0.02, "levels": [{"mesh": [n, n], "budget": "quick"} for n in meshes]},
        "reference": {"time_step": 0.02, "levels": [{"size": h, "budget": "quick"} for h in sizes]} if sizes else None,
        "sensitivity": None,
    }
    return load("cantilever").override(stated | changes)


def estimate(scene, level):
    if "no estimate" in os.environ.get("FAKE_SOLVER", ""):
        raise ValueError("asked to raise")
    memory = 1024.0 * 1000 if f"huge {_h(level):g}" in os.environ.get("FAKE_SOLVER", "") else 1.0
    return {"unknowns": _unknowns(level), "elements": 1, "memory_mb": memory, "modelled": ["all"], "left_out": ["none"]}


def solve(scene, level, progress=None):
    _obey(os.environ.get("FAKE_SOLVER", ""), level)
    if progress:
        progress(0.5)
    h = _h(level)
    times = np.linspace(0, scene.analysis.until, 3)
    value = -0.5 - scene.material.youngs_modulus / 1e9 * (1 + h * h)
    displacement = np.zeros((3, len(scene.probes), 3))
    displacement[:, :, 2] = (times / times[-1] * value)[:, None]
    failed = os.environ.get("FAKE_SOLVER") == f"fail {h:g}"
    return Result(
        scene=scene.physics(),
        solver="ancf" if hasattr(level, "mesh") else "reference",
        version="0",
        level=level.model_dump(mode="json"),
        h=h,
        unknowns=_unknowns(level),
        times=times,
        probes=tuple(probe.name for probe in scene.probes),
        probe_position=np.array([getattr(probe, "at", (1.0, 1.0, 0.0)) for probe in scene.probes]),
        displacement=displacement,
        energies={},
        status="newton_diverged" if failed else "ok",
        newton_iterations=7,
        facts={"threads": float(os.environ.get("OMP_NUM_THREADS", "nan"))},
    )


def _h(level):
    return 1 / level.mesh[0] if hasattr(level, "mesh") else level.size


def _unknowns(level):
    return round(12 / _h(level) ** 2)


def _obey(orders, level):
    """Misbehave as the environment asks: "kill 0.5;raise 0.25" at the levels with h = 0.5 and h = 0.25."""
    for order in orders.split(";"):
        what, _, h = order.partition(" ")
        if h == f"{_h(level):g}":
            _misbehave(what)


def _misbehave(what):
    if what == "raise":
        raise ValueError("asked to raise")
    if what == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "exit":
        os._exit(3)
    if what == "sleep":
        Path(os.environ["FAKE_SOLVER_ID"]).write_text(str(os.getpid()))
        time.sleep(60)
    if what == "print":
        print("{not json")
        os.write(1, b"from a library in C")
