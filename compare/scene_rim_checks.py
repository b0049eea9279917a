"""What a scene may not say of a rim although each key alone is well formed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from compare.scene import Level, Scene


def rim_problems(scene: Scene, levels: list[tuple[str, Level]]) -> Iterator[str]:
    """Problems of the rim and of the loads on it; levels: of both ladders, by their keys."""
    if scene.rim is None:
        for i, load in enumerate(scene.loads):
            if load.kind == "axle":
                yield f"loads.{i}.kind = 'axle': it acts on a rim, and the scene states none; state [rim]"
        return
    if scene.analysis.kind == "modes":
        yield "rim: modes are those of a plate whose supports stand still; state a clamp of its edges"
        return
    yield from _edges(scene)
    yield from _motion(scene)
    yield from _held_elsewhere(scene)
    yield from _mirrored(scene)
    yield from _schemes(scene, levels)


def _edges(scene: Scene) -> Iterator[str]:
    rim = scene.rim
    for i, edge in enumerate(rim.edges):
        if edge in rim.edges[:i]:
            yield f"rim.edges.{i} = {edge!r}: this edge is already named"
        elif scene.surface.closed and edge[0] == "x":
            yield f"rim.edges.{i} = {edge!r}: a full turn is closed there and has no such edge"
    for i, support in enumerate(scene.supports):
        if getattr(support, "edge", None) in rim.edges:
            yield f"supports.{i}.edge = {support.edge!r}: the rim already holds this edge"


def _motion(scene: Scene) -> Iterator[str]:
    rim, static = scene.rim, scene.analysis.kind == "static"
    for i, component in enumerate(rim.free):
        if component in rim.free[:i]:
            yield f"rim.free.{i} = {component!r}: this direction is already named"
        elif rim.displacement["XYZ".index(component)]:
            key = f"rim.displacement = {list(rim.displacement)}"
            yield f"{key}: along {component} the rim is free, so its way is found; state 0 there"
    times = [time for time, _ in rim.history]
    if not times:
        yield "rim.history = []: needs at least one pair of time and factor"
    for j, (before, time) in enumerate(pairwise(times), start=1):
        if time <= before:
            yield f"rim.history.{j} = {list(rim.history[j])}: its time must be later than {before:g}"
    if static and rim.mass and not any(load.kind == "gravity" for load in scene.loads):
        yield f"rim.mass = {rim.mass:g}: statics without gravity has no use for it; leave this out"
    if not any(rim.spin):
        return
    key = f"rim.spin = {list(rim.spin)}"
    if static:
        yield f"{key}: statics has no velocity; leave this out or state analysis.kind = 'dynamic'"
    along = [axis for axis, value in zip("XYZ", rim.spin, strict=True) if value]
    if not scene.surface.closed or along != [scene.surface.axis]:
        yield f"{key}: a rim spins about the axis of a surface that is revolved by a full turn; state that, or no spin"


def _held_elsewhere(scene: Scene) -> Iterator[str]:
    """Supports that meet the rim at a corner and hold what moves with it."""
    rim = scene.rim
    for i, support in enumerate(scene.supports):
        if support.kind == "symmetry":
            continue  # see _mirrored
        if support.edge is not None and all(edge[0] == support.edge[0] for edge in rim.edges):
            continue  # opposite edges do not meet
        held = getattr(support, "components", "XYZ")
        moving = [c for c, size in zip("XYZ", rim.displacement, strict=True) if size or c in rim.free]
        for component in [c for c in moving if c in held][:1]:
            yield f"supports.{i}: it meets the rim and holds {component}, along which the rim moves; leave this out"
        if any(rim.spin):
            yield f"supports.{i}: it meets a rim that spins, and would stop it; leave this out"


def _mirrored(scene: Scene) -> Iterator[str]:
    """Motions and loads of the rim that a stated symmetry would turn into others."""
    rim = scene.rim
    for normal in dict.fromkeys(s.normal for s in scene.supports if s.kind == "symmetry"):
        c, where = "XYZ".index(normal), f"a symmetry mirrors {normal}"
        if normal in rim.free:
            yield f"rim.free = {list(rim.free)}: {where}, along which its halves would part; leave {normal} out"
        if rim.displacement[c]:
            yield f"rim.displacement = {list(rim.displacement)}: {where}; state 0 there, or the whole body"
        if any(rim.spin[a] for a in range(3) if a != c):
            yield f"rim.spin = {list(rim.spin)}: {where}; a mirrored rim turns about its normal alone"
        for i, load in enumerate(scene.loads):
            if load.kind == "axle" and load.force[c]:
                yield f"loads.{i}.force = {list(load.force)}: {where}; state 0 there, or the whole body"


def _schemes(scene: Scene, levels: list[tuple[str, Level]]) -> Iterator[str]:
    """What cannot follow a rim."""
    if getattr(scene.analysis, "follow", "load") == "arc-length":
        yield "rim: an arc length follows dead loads of a plate whose supports stand still; state a clamp of its edges"
    for key, level in levels:
        if level.integrator == "energy-momentum":
            reason = "takes supports that stand still; state 'trapezoidal' or 'generalized-alpha'"
            yield f"{key}.integrator = 'energy-momentum': with a rim it {reason}"
        if getattr(level, "enrich", None) is not None:
            yield f"{key}.enrich = {level.enrich:g}: its indicator takes supports that stand still; leave this out"
