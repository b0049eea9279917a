"""A scene's obstacles on the mesh, and the record of what they did to the plate. Imported where a scene has some."""

from __future__ import annotations

import numpy as np

from reference_fe.contact import REACH, Contact, Face, Law, Obstacle, drum, face, plane, sphere
from reference_fe.elasticity import Pattern
from reference_fe.mesh import Solid
from reference_fe.surface import Frame

BODIES = {
    "plane": lambda shape: plane(shape.point, shape.normal),
    "sphere": lambda shape: sphere(shape.centre, shape.radius),
    "drum": lambda shape: drum(shape.point, shape.axis, shape.radius),
}


def contact_of(obstacles, solid: Solid, where: Pattern) -> Contact:
    """The scene's obstacles; those of one face and law share their points. Raises MeshError."""
    faces: dict[tuple[str, str], Face] = {}
    found = []
    for obstacle in obstacles:
        key = (obstacle.face, obstacle.law)
        if key not in faces:
            faces[key] = face(solid, where, -1 if obstacle.face == "bottom" else 1, obstacle.law)
        law = Law(
            obstacle.stiffness,
            obstacle.damping,
            obstacle.friction,
            obstacle.stick_stiffness,
            obstacle.stick_damping,
        )
        found.append(Obstacle(BODIES[obstacle.shape.kind](obstacle.shape), law, faces[key]))
    return Contact(tuple(found), REACH * solid.extent)


class Record:
    """Resultants (N) and pressed areas (m2) of each obstacle at each output time, and the last pressures."""

    def __init__(self, contact: Contact):
        self.contact = contact
        self.force: list[np.ndarray] = []
        self.area: list[list[float]] = []
        self.pressure: list[np.ndarray] = []

    def add(self, touch, displacement: np.ndarray, velocity: np.ndarray) -> None:
        """One output time: the law at that instant, displacement and velocity (n, 3) of all nodes."""
        now = self.contact.now(touch, displacement, velocity)
        weights = [obstacle.face.weight for obstacle in self.contact.obstacles]
        self.force.append(
            np.array([np.einsum("fq,fqi->i", w, traction) for w, (_, traction) in zip(weights, now, strict=True)])
        )
        self.area.append([float(w[p > 0].sum()) for w, (p, _) in zip(weights, now, strict=True)])
        self.pressure = [pressure for pressure, _ in now]

    def arrays(self, frame: Frame) -> dict[str, np.ndarray]:
        """What a Result says of contact; obstacles of one face press on the same points."""
        faces = {id(obstacle.face): obstacle.face for obstacle in self.contact.obstacles}
        total = {key: np.zeros_like(one.weight) for key, one in faces.items()}
        for obstacle, pressure in zip(self.contact.obstacles, self.pressure, strict=False):
            total[id(obstacle.face)] += pressure
        box = np.concatenate([one.box.reshape(-1, 3) for one in faces.values()])
        parameters = np.array(frame.origin) + box[:, :2] / np.array(frame.scale)
        count = len(self.contact.obstacles)
        return {
            "force": np.array(self.force).reshape(-1, count, 3),
            "area": np.array(self.area).reshape(-1, count),
            "points": np.column_stack([parameters, box[:, 2]]),
            "share": np.concatenate([one.weight.ravel() for one in faces.values()]),
            "pressure": np.concatenate([one.ravel() for one in total.values()]),
        }
