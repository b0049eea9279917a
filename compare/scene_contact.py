"""What the plate may touch: rigid bodies that stand still, and the law of the contact. Units: see scene.py.

gap g (m): signed distance of a point of the plate's face from the body, positive outside; penetration d = -g.
n: unit normal out of the body there. v: velocity of the point. d' = -n . v, v_t = v - (n . v) n.

The normal traction is p = max(0, k d + c d') while d > 0, and nothing where d <= 0: damping never pulls.
The friction is Coulomb's with stick, a traction t tangent to the body: from the slip s (m), which a step takes on
by v_t dt, the trial is t* = -(k_s s + c_s v_t). Where |t*| <= mu p the point sticks and t = t*; beyond, it slides,
t = mu p t*/|t*|, and s falls back to the length mu p / k_s where it is longer: what friction spends is never negative.
A point that leaves the body forgets its slip.
With law "pressure" tractions are Pa, k N/m3, c N s/m3, and each solver integrates them over its own true face.
With law "points", the paper's, they are forces (N) at the solver's own contact points, k N/m, c N s/m: the answer then
depends on how many points there are, so that two solvers cannot be compared by it.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from compare.scene_parts import Number, Part, Positive, Vector

NotNegative = Annotated[Number, Field(ge=0)]


class Plane(Part):
    """Half space below the plane through `point` whose normal points out of the body."""

    kind: Literal["plane"]
    point: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, 1.0)


class Sphere(Part):
    """Ball."""

    kind: Literal["sphere"]
    centre: Vector
    radius: Positive


class Drum(Part):
    """Endless circular cylinder about the axis through `point`."""

    kind: Literal["drum"]
    point: Vector
    axis: Vector
    radius: Positive


Shape = Annotated[Plane | Sphere | Drum, Field(discriminator="kind")]


class Obstacle(Part):
    """A rigid body that one face of the plate may touch; see the module's docstring for the law.

    stick_stiffness and stick_damping: of the friction's stick; where they are not stated, those of the normal.
    """

    name: str
    shape: Shape
    face: Literal["bottom", "top"] = "bottom"
    law: Literal["pressure", "points"] = "pressure"
    stiffness: Positive
    damping: NotNegative = 0.0
    friction: NotNegative = 0.0
    stick_stiffness: Positive | None = None
    stick_damping: NotNegative | None = None
