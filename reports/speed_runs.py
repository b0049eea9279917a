"""Units: whole runs of both solvers and of the peers that are installed.

A run is the solver's own solve(scene, level), so mesh and set-up are counted unless a key says otherwise.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from compare import study
from compare.external import calculix, exudyn
from compare.scene import AncfLevel, ReferenceLevel, Scene, load
from compare.table import height
from reports.speed_profile import bare, clocked, integrated, operations
from reports.timing import least

EXACT = [7, 7, 3]
ENOUGH = [5, 5, 3]  # of enriched elements: the heights of the patch are within 2e-5 of those of EXACT
PAPERS = "conforming"
PLAIN, GROOVED, PATCH = "cantilever_plain", "cantilever", "cantilever_plain_patch"


def ancf(
    scene: str,
    mesh: int,
    time_step: float,
    points: list[int] = EXACT,
    until: float = 1.0,
    repeats: int = 1,
    element: str = PAPERS,
) -> dict[str, Any]:
    """ANCF from start to end: least CPU and wall seconds of `repeats` runs.

    "split", "calls": CPU seconds of the cheapest run and calls by part: set-up, those of `speed_profile`, the rest.
    "gflop": 10^9 operations by part that no run can spare. "bare": CPU seconds of its products, factors and solutions
    alone, see `speed_profile.bare`.
    """
    from ancf.run import solve
    from ancf.unpack import build

    stated = _until(unpictured(scene), until)
    level = AncfLevel(mesh=(mesh, mesh), element=element, points=tuple(points), time_step=time_step)
    with integrated() as forms:
        model = build(stated, level)
    setup, results, splits = least(lambda: build(stated, level), repeats), [], []
    for _ in range(repeats):
        with clocked() as (spent, calls):
            results.append(solve(stated, level))
        rest = max(0.0, results[-1].cpu_seconds - setup - sum(spent.values()))
        splits.append({"set-up": setup, **spent, "rest": rest})
    cheapest = min(range(repeats), key=lambda k: results[k].cpu_seconds)
    return {
        **_summary(results),
        "setup_seconds": setup,
        "distinct": results[0].facts["distinct_elements"],
        "split": splits[cheapest],
        "calls": calls,
        "gflop": operations(model.system, calls, forms),
        "bare": bare(model.system, model.mesh.vectors.ravel(), calls),
    }


def _summary(results: list) -> dict[str, Any]:
    """Numbers of several runs of one question; the status of the worst."""
    first, failed = results[0], [r.status for r in results if r.status != "ok"]
    if failed:
        return {"status": f"failed: {failed[0]}: {first.message}"}
    return {
        "unknowns": first.unknowns,
        "h": first.h,
        "height": float(first.position("P")[-1, 2]),
        "cpu_seconds": min(r.cpu_seconds for r in results),
        "wall_seconds": min(r.seconds for r in results),
        "steps": first.steps,
        "newton_iterations": first.newton_iterations,
        "factorisations": first.facts["factorisations"],
    }


def unpictured(name: str) -> Scene:
    """A shipped scene without the stress on its surface, which is for pictures: the cost of the height alone."""
    return load(name).override({"surface_stress": False})


def _until(scene: Scene, until: float) -> Scene:
    """The scene ended at `until` (s)."""
    return scene if until == scene.analysis.until else scene.override({"analysis.until": until})


def table5(meshes: list[int], time_step: float = 0.01, jobs: int = 2) -> dict[str, Any]:
    """Both ANCF columns of Table 5 at these meshes, each row at its rule, as a study of two processes.

    "wall_seconds" counts all of it: the start of each process and the repetition of cheap runs, up to three times.
    "solve_seconds" is the sum of the runs' own least wall times.
    """
    begin = time.perf_counter()
    scenes = [_rows(load(name), meshes, time_step) for name in (PLAIN, GROOVED)]
    with tempfile.TemporaryDirectory() as folder:
        entries = study.run(scenes, {"ancf": "ancf.run"}, "full", Path(folder), jobs)
    wall = time.perf_counter() - begin
    failed = [f"{study.label(entry)}: {entry.status}" for entry in entries if not entry.ok]
    if failed:
        return {"status": f"failed: {failed[0]}"}
    rows = [
        {"scene": e.scene.name, "mesh": e.level.mesh[0], "height": height(e), "wall_seconds": e.wall_seconds}
        for e in entries
    ]
    return {"wall_seconds": wall, "solve_seconds": sum(row["wall_seconds"] for row in rows), "rows": rows}


def _rows(scene: Scene, meshes: list[int], time_step: float) -> Scene:
    """The scene with one ANCF level per printed row at the rule it was found to use, 3x3x2 where none is known."""
    levels = [
        {"mesh": list(row.mesh), "points": list(row.points or (3, 3, 2)), "time_step": time_step, "element": PAPERS}
        for row in scene.published.rows
        if row.mesh[0] in meshes
    ]
    return scene.override({"ancf": {"levels": levels}, "reference": None, "sensitivity": None, "companions": []})


def size(unknowns: int, tries: int = 8) -> dict[str, Any]:
    """Edge length of the reference's mesh of the plain cantilever whose unknowns are nearest to a number.

    Secant steps on log unknowns against log size; the best of at most `tries` meshes, or the first within 0.5 %.
    """
    scene, guess, exponent, found = load(PLAIN), 0.14 * (5310 / unknowns) ** 0.5, -2.0, []
    for _ in range(tries):
        got = _unknowns(scene, guess)
        found.append((abs(np.log(got / unknowns)), guess, got))
        if found[-1][0] < 0.005:
            break
        if len(found) > 1 and found[-2][2] != got:
            slope = np.log(got / found[-2][2]) / np.log(guess / found[-2][1])
            exponent = min(max(slope, -4.0), -1.0)
        guess = round(float(guess * (unknowns / got) ** (1 / exponent)), 5)
    _, best, got = min(found)
    return {"size": best, "unknowns": got}


def _unknowns(scene: Scene, edge: float) -> int:
    """Unknowns of the reference's mesh of a plate clamped at x = 0."""
    points = _mesh(scene, edge)[1].mesh.doflocs
    return 3 * int((points[0] > 1e-9).sum())


def reference(scene: str, size: float, time_step: float, until: float = 1.0, repeats: int = 1) -> dict[str, Any]:
    """The reference from start to end: least CPU and wall seconds of `repeats` runs, and its own split."""
    from reference_fe.run import solve

    stated = _until(unpictured(scene), until)
    level = ReferenceLevel(size=size, time_step=time_step)
    results = [solve(stated, level) for _ in range(repeats)]
    found = _summary(results)
    facts = min(results, key=lambda r: r.cpu_seconds).facts
    found["tetrahedra"] = facts["tetrahedra"]
    parts = {name: facts[f"{name}_seconds"] for name in ("mesh", "force", "tangent", "factor", "solve")}
    return {**found, "split": {**parts, "rest": max(0.0, found["wall_seconds"] - sum(parts.values()))}}


def curve(
    conforming: list[int],
    enriched: list[int],
    sizes: list[float],
    time_step: float = 0.02,
    rounds: int = 2,
    closer: dict[str, list[Any]] | None = None,
    more: int = 4,
) -> dict[str, Any]:
    """The patch-loaded plain cantilever on a ladder of each ANCF element and of the reference, one run at a time.

    Each level keeps its least times of `rounds` rounds; a round runs a cheap level up to three times. All take the
    same time steps, so what is left between levels is the error in space. Enriched elements have ENOUGH points.
    closer: levels that have `more` rounds besides, spread over as long again, since costs are read off between them.
    """
    ladders = [{"conforming": conforming, "enriched": enriched, "sizes": sizes}] * rounds
    ladders += [{"conforming": [], "enriched": [], "sizes": []} | closer] * more if closer else []
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for ladder in ladders:
        for row in _round(**ladder, time_step=time_step):
            first = rows.setdefault((row["series"], row["mesh"]), row)
            if row["status"] == first["status"] == "ok":
                first |= {key: min(first[key], row[key]) for key in ("wall_seconds", "cpu_seconds")}
    return {"rows": list(rows.values())}


def _round(conforming: list[int], enriched: list[int], sizes: list[float], time_step: float) -> list[dict[str, Any]]:
    """Rows of the levels of a curve, each run in turn."""
    meshes = [("conforming", n, EXACT) for n in conforming] + [("enriched", n, ENOUGH) for n in enriched]
    own = [{"mesh": [n, n], "element": name, "points": rule, "time_step": time_step} for name, n, rule in meshes]
    solid = [{"size": size, "time_step": time_step} for size in sizes]
    scene = unpictured(PATCH).override({"ancf": {"levels": own}, "reference": {"levels": solid}})
    solvers = {"ancf": "ancf.run", "reference": "reference_fe.run"}
    with tempfile.TemporaryDirectory() as folder:
        return [_level(entry) for entry in study.run([scene], solvers, "full", Path(folder), jobs=1)]


def _level(entry: study.Entry) -> dict[str, Any]:
    """A row of a curve; numbers are None where the level failed."""
    result = entry.result
    names = ("unknowns", "h", "cpu_seconds", "steps", "newton_iterations", "peak_mb")
    return {
        "series": getattr(entry.level, "element", "reference"),
        "mesh": study.level_name(entry.level),
        "height": height(entry),
        "wall_seconds": entry.wall_seconds,
        **{name: result and getattr(result, name) for name in names},
        "factorisations": result and result.facts.get("factorisations"),
        "status": entry.status,
    }


def own_steps(
    enriched: list[list[int]], sizes: list[float], time_steps: list[float], repeats: int = 3
) -> dict[str, Any]:
    """The patch-loaded plain cantilever at every mesh and time step, for each solver to choose its cheapest.

    "rows": height, least wall and CPU seconds of `repeats` runs. "time_shift": what the height (m) of a 4x4 mesh
    of enriched elements still gains from steps of 0.02 s to none, by Richardson's extrapolation with order 2.
    """
    from ancf.run import solve
    from reference_fe.run import solve as solve_solid

    def level(mesh: list[int], step: float) -> AncfLevel:
        return AncfLevel(mesh=tuple(mesh), element="enriched", points=tuple(ENOUGH), time_step=step)

    patch, rows = unpictured(PATCH), []
    for step in time_steps:
        ladder = {"levels": [{"mesh": [4, 4], "points": ENOUGH, "time_step": step}]}
        question = patch.override({"analysis.every": step, "ancf": ladder, "reference": None})
        asked = [("enriched", "x".join(map(str, mesh)), solve, level(mesh, step)) for mesh in enriched]
        asked += [("reference", f"h={h:g}", solve_solid, ReferenceLevel(size=h, time_step=step)) for h in sizes]
        for series, mesh, solver, chosen in asked:
            found = _summary([solver(question, chosen) for _ in range(repeats)])
            rows.append({"series": series, "mesh": mesh, "time_step": step, "status": "ok", **found})
    coarse, middle, fine = (_summary([solve(patch, level([4, 4], step))])["height"] for step in (0.02, 0.01, 0.005))
    return {"rows": rows, "time_shift": fine + (fine - middle) / 3 - coarse}


def newton(size: float, steps: int = 3, time_step: float = 0.01) -> dict[str, Any]:
    """The plain cantilever on a large mesh: wall seconds of each time step and of one full Newton iteration.

    A Newton iteration is one tangent, one factorisation on the known pattern, one solution and one residual.
    The first step includes the analysis of the pattern.
    """
    from reference_fe import dynamics

    begin = time.perf_counter()
    model = discretised(load(PLAIN), size)
    setup = time.perf_counter() - begin
    acting, memory = model.system, model.memory
    state, walls = dynamics.begin(acting, model.velocity), []
    for k in range(steps):
        begin = time.perf_counter()
        state, _ = dynamics.advance(acting, dynamics.TRAPEZOIDAL, state, (k + 1) * time_step, time_step, memory)
        walls.append(time.perf_counter() - begin)
    counts = {"newton_iterations": memory.iterations, "factorisations": memory.factorisations}
    parts = _iteration(acting, memory, state, 4 / time_step**2)
    memory.solver.close()
    return {
        "unknowns": 3 * acting.pattern.free.size,
        "tetrahedra": model.solid.tetrahedra,
        "setup_seconds": setup,
        "step_seconds": walls,
        "slowest_step_seconds": max(walls),
        **counts,
        "newton_seconds": sum(parts.values()),
        "split": parts,
    }


def _mesh(scene: Scene, edge: float):
    """The reference's frame and mesh of a scene at an edge length (m)."""
    from reference_fe.mesh import make
    from reference_fe.unpack import mid_surface, plate_of, spacing_of

    frame, surface = mid_surface(scene)
    plate = plate_of(scene, frame, surface)
    return frame, make(plate, spacing_of(plate, edge), surface)


def discretised(scene: Scene, edge: float):
    """The reference's model of a scene at an edge length (m)."""
    from reference_fe.unpack import discretise

    return discretise(scene, *_mesh(scene, edge))


def _iteration(acting, memory, state, inertia: float, repeats: int = 2) -> dict[str, float]:
    """Least wall seconds of each part of a Newton iteration."""
    least = {}
    for _ in range(repeats):
        marks = [time.perf_counter()]
        values = acting.tangent(state.u, 1.0, inertia)
        marks.append(time.perf_counter())
        memory.solver.factorise(values)
        marks.append(time.perf_counter())
        memory.solver.solve(state.force.ravel())
        marks.append(time.perf_counter())
        acting.internal(state.u)
        marks.append(time.perf_counter())
        for name, seconds in zip(("tangent", "factor", "solve", "force"), np.diff(marks).tolist(), strict=True):
            least[name] = min(least.get(name, np.inf), seconds)
    return least


def calculix_run(size: float, time_step: float, until: float = 1.0, scene: str = PLAIN) -> dict[str, Any]:
    """CalculiX on the reference's mesh of a cantilever, with its nodal forces and equal steps.

    "height": of P as the reference reads it off the same nodes. The reference takes the same steps where time_step
    divides the scene's time between outputs.
    """
    if not calculix.available():
        return {"status": "absent: ccx is not on the path (Debian package calculix-ccx)"}
    stated = load(scene)
    model = discretised(stated, size)
    nodes, weights = model.solid.mesh.doflocs.T, model.probes[0]
    printed = np.flatnonzero(weights)
    problem = calculix.Problem(
        nodes=nodes,
        tetrahedra=model.system.table.nodes,
        fixed=np.flatnonzero(model.system.pattern.number < 0),
        force=model.system.loads(1.0),
        history=stated.loads[0].history,
        density=stated.material.density,
        youngs_modulus=stated.material.youngs_modulus,
        poissons_ratio=stated.material.poissons_ratio,
        step=time_step,
        until=until,
        printed=printed,
    )
    answer = calculix.solve(problem)
    path = weights[printed] @ (nodes[printed] + answer.displacement)
    return {
        "version": calculix.version(),
        "unknowns": 3 * model.system.pattern.free.size,
        "tetrahedra": model.solid.tetrahedra,
        "height": float(path[-1, 2]),
        "cpu_seconds": answer.cpu_seconds,
        "wall_seconds": answer.wall_seconds,
        "steps": len(answer.times),
    }


def exudyn_run(mesh: int = 16, steps: int = 100) -> dict[str, Any]:
    """Exudyn's thin ANCF plate under the plain cantilever's load: CPU seconds of its time steps."""
    if not exudyn.available():
        return {"status": "absent: the Python package exudyn is not installed"}
    found = exudyn.cantilever(mesh, steps, 1.0, 0.05, 2.0e6, 0.0, 2000.0, -50.0)
    return {"height": found.deflection, "cpu_seconds": found.cpu_seconds, "steps": steps}
