"""A rigid rim that holds edges of the plate, as a tire's beads are held. Units and directions: see scene.py.

The face of each of its edges moves as one rigid body with the rim: with u the translation of the rim and R the
rotation by `spin` x t about the origin of space, a point X of it is at R X + u. Along a direction that is `free`, u
follows from the forces on the rim: those of the plate, its own inertia and weight, and the loads of kind "axle".
Along the others u is `displacement` times `history`. How it turns is always stated: not at all without a spin.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from compare.scene_parts import CONSTANT, Component, Edge, History, NotNegative, Part, Vector


class Rim(Part):
    """See the module's docstring. mass (kg): of the rim alone, on the part of it that the scene models.

    edges: of the plate, all held by this one rim. displacement (m), spin (rad/s): constant from t = 0 on.
    """

    edges: Annotated[tuple[Edge, ...], Field(min_length=1)]
    free: tuple[Component, ...] = ()
    mass: NotNegative = 0.0
    displacement: Vector = (0.0, 0.0, 0.0)
    history: History = CONSTANT
    spin: Vector = (0.0, 0.0, 0.0)
