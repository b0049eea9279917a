"""What a scene may not state beside a plane of symmetry: what its mirror image would turn into something else."""

from __future__ import annotations

from collections.abc import Iterator

from compare.scene import Scene
from compare.scene_geometry import plane_of

NEAR = 1e-9  # m


def symmetry_problems(scene: Scene) -> Iterator[str]:
    """Loads, obstacles and initial motion that break a stated symmetry, once for every plane that each breaks."""
    planes: dict[tuple[str, float], tuple[str, float]] = {}
    for support in scene.supports:
        if support.kind == "symmetry":
            at, size = plane_of(scene, support.edge, support.normal)
            planes.setdefault((support.normal, round(at / size, 8)), (support.edge, at))
    for (normal, _), (edge, at) in planes.items():
        c, where = "XYZ".index(normal), f"the symmetry at {edge} mirrors {normal}"
        yield from _loads(scene, c, edge, where)
        yield from _initial(scene, c, where)
        yield from _obstacles(scene, c, at, where)


def _loads(scene: Scene, c: int, edge: str, where: str) -> Iterator[str]:
    for i, load in enumerate(scene.loads):
        if load.kind == "gravity" and load.acceleration[c]:
            yield f"loads.{i}.acceleration = {list(load.acceleration)}: {where}; state 0 there, or the whole body"
        elif load.kind == "edge" and load.edge == edge and load.force[c]:
            yield f"loads.{i}.force = {list(load.force)}: {where}, and the load is on that edge; state 0 there"
        elif load.kind == "moment" and load.edge == edge and any(load.moment[a] for a in range(3) if a != c):
            yield f"loads.{i}.moment = {list(load.moment)}: {where}, and the load on it turns about another axis"


def _initial(scene: Scene, c: int, where: str) -> Iterator[str]:
    if scene.initial is None:
        return
    velocity, turning = scene.initial.velocity, scene.initial.angular_velocity
    if velocity[c]:
        yield f"initial.velocity = {list(velocity)}: {where}; state 0 there, or the whole body"
    if any(turning[a] for a in range(3) if a != c):
        yield f"initial.angular_velocity = {list(turning)}: {where}; a mirrored body turns about its normal alone"


def _obstacles(scene: Scene, c: int, at: float, where: str) -> Iterator[str]:
    for i, obstacle in enumerate(scene.obstacles):
        shape, key = obstacle.shape, f"obstacles.{i}.shape"
        if shape.kind == "plane":
            if shape.normal[c]:
                yield f"{key}.normal = {list(shape.normal)}: {where}, which makes another plane of it; state 0 there"
            continue
        name = "centre" if shape.kind == "sphere" else "point"
        place = getattr(shape, name)
        along = shape.kind == "drum" and not any(shape.axis[a] for a in range(3) if a != c)
        if not along and abs(place[c] - at) > NEAR:
            yield f"{key}.{name} = {list(place)}: {where}, which makes two bodies of it; state {at:g} there"
        if shape.kind == "drum" and shape.axis[c] and not along:
            yield f"{key}.axis = {list(shape.axis)}: {where}, which makes another drum of it"
