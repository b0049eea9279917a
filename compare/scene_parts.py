"""What a scene is made of: numbers, what holds the plate and what pushes it. Coordinates and units: see scene.py."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

Edge = Literal["x0", "x1", "y0", "y1"]
Corner = Literal["x0y0", "x0y1", "x1y0", "x1y1"]
Component = Literal["X", "Y", "Z"]
Components = Annotated[tuple[Component, ...], Field(min_length=1)]
Over = Literal["face", "middle", "bottom", "top"]


def exactly(count: int, what: str) -> BeforeValidator:
    """Refuses a list of another length by saying how many entries it needs."""

    def check(value: Any) -> Any:
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise ValueError(f"needs {count} {what}")
        return tuple(value)

    return BeforeValidator(check)


Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False), AfterValidator(lambda value: value + 0.0)]
Count = Annotated[int, Field(strict=True, gt=0)]
Pair = exactly(2, "numbers")
Triple = exactly(3, "numbers")
Interval = Annotated[tuple[Number, Number], Pair]
Region = Annotated[tuple[Interval, Interval], exactly(2, "intervals, [[x0, x1], [y0, y1]]")]
Vector = Annotated[tuple[Number, Number, Number], Triple]


class Part(BaseModel):
    """A frozen piece of a scene that knows every key it may have."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Clamp(Part):
    """An edge whose cross-section is held.

    gradients = "all": every nodal gradient is fixed too (the paper's clamp, all 12 coordinates).
    gradients = "tangential": only what a Dirichlet condition on the face fixes; the gradient
    normal to the edge stays free. A displacement-based solid reads both the same way.
    """

    kind: Literal["clamp"]
    edge: Edge
    gradients: Literal["all", "tangential"] = "tangential"


class Hold(Part):
    """Components of the displacement held at zero on an edge, at a corner, or in the whole plate (plane strain: Z).

    over: "face", the whole height of the edge or corner; or only the "middle", its line (point) of the
    mid-surface; or only its "bottom" or "top" line (point), which a plate solver cannot tell from the face.
    """

    kind: Literal["hold"]
    edge: Edge | None = None
    corner: Corner | None = None
    whole: bool = False
    components: Components
    over: Over = "face"


class Symmetry(Part):
    """An edge in a plane of symmetry: its whole face stays in the plane and slides in it without friction.

    normal: of the plane. The undeformed face must lie in the plane.
    """

    kind: Literal["symmetry"]
    edge: Edge
    normal: Component


Support = Annotated[Clamp | Hold | Symmetry, Field(discriminator="kind")]
History = tuple[Interval, ...]
CONSTANT: History = ((0.0, 1.0),)


class PointLoad(Part):
    """Dead force (N) at (x, y), spread evenly over the line through the thickness there."""

    kind: Literal["point"]
    at: Interval
    force: Vector
    history: History = CONSTANT


class EdgeLoad(Part):
    """Dead force (N, total), spread evenly over the face of an edge."""

    kind: Literal["edge"]
    edge: Edge
    force: Vector
    history: History = CONSTANT


class PatchLoad(Part):
    """Dead force (N, total), spread evenly over the volume whose (x, y) lies in the region."""

    kind: Literal["patch"]
    region: Region
    force: Vector
    history: History = CONSTANT


class Gravity(Part):
    """Acceleration (m/s2) on all of the mass."""

    kind: Literal["gravity"]
    acceleration: Vector
    history: History = CONSTANT


class Pressure(Part):
    """Pressure (Pa, positive into the body) on a whole face, by area and normal of the undeformed face: dead.

    follower: by area and normal of the deformed face, as a gas presses.
    """

    kind: Literal["pressure"]
    face: Literal["bottom", "top"]
    pressure: Number
    follower: bool = False
    history: History = CONSTANT


class EdgeMoment(Part):
    """Moment vector (N m, total) on the face of an edge, as a traction that turns with it; statics only.

    The traction is uniform along the edge and linear in z, without resultant. With the edge's director d, the
    displaced face's mean slope along z, and the component d' of d normal to the moment M, it points along
    M x d' and has the size that does the work |M| per radian by which d' turns about M. So the axis stays,
    the lever turns, and the load has a potential: it is a follower load with a symmetric tangent.
    """

    kind: Literal["moment"]
    edge: Edge
    moment: Vector
    history: History = CONSTANT


class AxleLoad(Part):
    """Dead force (N) on the rim, on the part of it that the scene models."""

    kind: Literal["axle"]
    force: Vector
    history: History = CONSTANT


Load = Annotated[
    PointLoad | EdgeLoad | PatchLoad | Gravity | Pressure | EdgeMoment | AxleLoad,
    Field(discriminator="kind"),
]


class SaintVenantKirchhoff(Part):
    """Young's modulus E (Pa), Poisson's ratio nu, density (kg/m3) of a St. Venant-Kirchhoff solid."""

    kind: Literal["svk"]
    youngs_modulus: Positive
    poissons_ratio: Number = 0.0
    density: Positive | None = None


class MooneyRivlin(Part):
    """U = mu10 (I1' - 3) + mu01 (I2' - 3) + k/2 (J - 1)^2 in J/m3, k the bulk modulus; constants in Pa.

    I1' = I1 J^(-2/3) and I2' = I2 J^(-4/3) are the invariants of the right Cauchy-Green tensor without its change
    of volume. At rest the shear modulus is 2 (mu10 + mu01). mu01 = 0 is a neo-Hookean solid. density in kg/m3.
    """

    kind: Literal["mooney-rivlin"]
    mu10: Positive
    mu01: NotNegative = 0.0
    bulk_modulus: Positive
    density: Positive | None = None


Material = Annotated[SaintVenantKirchhoff | MooneyRivlin, Field(discriminator="kind")]
