"""Scene: what is to be computed, stated once for every solver, in SI units.

A scene states; it computes nothing that a solver uses: dimensions, material constants, groove
curves, supports, loads, probes and output times. No stiffness, interpolation or integration lives
here, because whatever shared code computed, both solvers would get wrong together.

Reference coordinates (x, y, z): x and y are the parameters of the mid-surface (metres on a rectangle, knot values
on a NURBS patch, angle and knot value on a revolved section), z is the distance from it along its normal in metres.
Edges of the plate are named x0, x1, y0, y1: the side where that parameter is least or greatest. "bottom" is the
face of negative z, "top" that of positive z.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationError

from compare.scene_contact import Obstacle
from compare.scene_errors import SceneError, describe
from compare.scene_outline import Outlined
from compare.scene_parts import (
    Component,
    Count,
    Interval,
    Load,
    Material,
    Number,
    Pair,
    Part,
    Positive,
    Region,
    Support,
    Triple,
    Vector,
    exactly,
)
from compare.scene_rim import Rim
from compare.treads import PREFIX, Tread
from compare.treads import grooves as tread_grooves

SCHEMA = 1
BUDGETS = ("quick", "standard", "full")
SHIPPED = Path(__file__).parent / "scenes"
TURN = 1e-9  # rad: so near to 2 pi is a full turn

Budget = Literal["quick", "standard", "full"]


class Rectangle(Part):
    """Flat mid-surface 0 <= x <= length, 0 <= y <= width at Z = 0, normal +Z. Metres."""

    kind: Literal["rectangle"]
    length: Positive
    width: Positive
    closed: ClassVar[bool] = False

    @property
    def span(self) -> tuple[Interval, Interval]:
        """Range of the parameters x and y."""
        return (0.0, self.length), (0.0, self.width)


class NurbsPatch(Part):
    """NURBS mid-surface (paper Eq. 4): control_points[i][j] = (X, Y, Z) in metres."""

    kind: Literal["nurbs"]
    degree: Annotated[tuple[Count, Count], Pair]
    knots: Annotated[tuple[tuple[Number, ...], tuple[Number, ...]], exactly(2, "knot vectors")]
    control_points: tuple[tuple[Vector, ...], ...]
    weights: tuple[tuple[Positive, ...], ...] | None = None
    closed: ClassVar[bool] = False

    @property
    def span(self) -> tuple[Interval, Interval]:
        """Range of the parameters x and y: first and last knot of each direction."""
        return tuple((knots[0], knots[-1]) for knots in self.knots)


class Section(Part):
    """NURBS curve (paper Eq. 3) through (along, radius): along an axis and away from it, in metres."""

    degree: Count
    knots: tuple[Number, ...]
    control_points: tuple[Interval, ...]
    weights: tuple[Positive, ...] | None = None


class Revolved(Part):
    """A section turned about an axis through the origin of space; x is the angle in rad, y the section's parameter.

    The angle is 0 on the axis of space that follows the axis of revolution in the order X, Y, Z, X, and grows
    toward the one after that: about Y from Z toward X. The normal points away from the axis where the section's
    parameter grows along it. A range of 2 pi is a closed ring: its seam is no edge.
    """

    kind: Literal["revolved"]
    axis: Component
    angle: Interval
    section: Section

    @property
    def span(self) -> tuple[Interval, Interval]:
        """Range of the angle, and first and last knot of the section."""
        return self.angle, (self.section.knots[0], self.section.knots[-1])

    @property
    def closed(self) -> bool:
        """Whether the angle runs through a full turn."""
        return abs(self.angle[1] - self.angle[0] - 2 * math.pi) <= TURN


Surface = Annotated[Rectangle | NurbsPatch | Revolved, Field(discriminator="kind")]


class Profile(Part):
    """Cross-section of a band as a NURBS curve (paper Eq. 3) through (across, depth), metres.

    The across coordinates of the control points must not decrease; the first and the last one are
    the edges of the band, at depth 0 (a vertical wall is part of the curve).
    """

    degree: Count
    control_points: tuple[Interval, ...]
    knots: tuple[Number, ...]
    weights: tuple[Positive, ...] | None = None


class Band(Part):
    """A straight band on one face that runs along x or y in the mid-surface parameters.

    Either `across` (the two edges) and `depth` (metres, constant: a rectangular section), or
    `profile`. `extent` limits the band along its own direction; without it the band crosses the
    whole plate. For a groove the depth is cut away; for a protrusion it is added. Where grooves of
    one face cross, the deeper one counts.
    """

    name: str
    face: Literal["bottom", "top"]
    along: Literal["x", "y"]
    across: Interval | None = None
    depth: Positive | None = None
    profile: Profile | None = None
    extent: Interval | None = None

    @property
    def edges(self) -> Interval:
        """The two edges of the band, in the parameter that runs across it."""
        if self.profile is None:
            return self.across
        points = self.profile.control_points
        return points[0][0], points[-1][0]


Feature = Annotated[
    Annotated[Band, Tag("band")] | Annotated[Outlined, Tag("outlined")],
    Discriminator(lambda value: "outlined" if _has(value, "outline") else "band"),
]


class Initial(Part):
    """Rigid initial velocity (m/s) of the undeformed plate at t = 0: v = velocity + angular_velocity x r.

    r is measured from the origin of space; angular_velocity in rad/s.
    """

    velocity: Vector = (0.0, 0.0, 0.0)
    angular_velocity: Vector = (0.0, 0.0, 0.0)


class PointProbe(Part):
    """Displacement at one point (x, y, z) of the reference shape; volume_ratio: det F there too."""

    name: str
    at: Vector
    volume_ratio: bool = False


class PatchProbe(Part):
    """Mean displacement over the volume whose (x, y) lies in the region."""

    name: str
    region: Region


Probe = Annotated[
    Annotated[PointProbe, Tag("at")] | Annotated[PatchProbe, Tag("region")],
    Discriminator(lambda value: "region" if _has(value, "region") else "at"),
]


def _has(value: Any, key: str) -> bool:
    return key in value if isinstance(value, dict) else hasattr(value, key)


class Analysis(Part):
    """Dynamics over time, or statics where time is only the parameter of the load histories.

    Output at t = 0, every, 2 every, ... until (s). follow = "arc-length": statics whose load parameter may fall and
    rise again, as where a shell snaps through; output at every step up to the first equilibrium at t = until.
    """

    kind: Literal["dynamic", "static"]
    follow: Literal["load", "arc-length"] = "load"
    until: Positive = 1.0
    every: Positive = 1.0


class Modes(Part):
    """Natural frequencies of small vibrations about the undeformed plate: the `count` lowest elastic ones.

    Rigid motions that the supports leave free have the frequency 0 and are not among them.
    """

    kind: Literal["modes"]
    count: Count


class AncfLevel(Part):
    """One resolution of the ANCF solver.

    mesh: elements along x and y. points: Gauss points (x, y, z) in each subdomain, which is the
    whole element where no groove edge divides it. integration: "subdomain" or "global" (Eqs. 8, 7), or "sparing", which
    takes the fewest points in a narrow subdomain that err no more there than `points` in a whole element; so it does in
    parts of the thickness that kinks of rubber elements divide.
    contact_points: points along x and y in each subdomain of a face that may touch; as `points` where not stated.
    element: "enriched", which does not lock, the paper's "conforming" one, or "acm", whose mid-surface Chrono uses.
    fit: grid lines on the edges of grooves and protrusions and, where there is room, at these distances (in
    thicknesses) beside them; of the lines that `mesh` asks for those that stay away from them.
    enrich: between 0 and 1. The layer beyond a groove's floor may then shear on its own, at the nodes that bring
    most; an indicator takes nodes until the others promise less than 1 - enrich of the first gain. On grid lines
    that are walls of grooves it may take functions that fade out from them.
    walls: whether elements that a groove or a protrusion crosses may kink where its floor or top begins and ends; each
    such line brings two vectors on every grid line that crosses it.
    lips: with walls. The material beyond the floor ends at them with a free face; it may stay behind what is below it
    there, by a vector more on every grid line, where that material reaches about a thickness or less beyond the wall:
    to the next wall or to the side of the element, of the next one where the side is all but at the wall.
    volumetric: how elements of Mooney-Rivlin material are kept from locking as they near incompressibility.
    "relaxed", the default: the thickness strain is free at each point, so that the stress normal to the plate is
    bilinear in the element; "reduced": one point fewer each way for the volumetric energy, as in the paper;
    "full": not at all.
    integrator: "energy-momentum" keeps energy and momenta at any step; the others are cheaper per step.
    time_step: seconds, or the increment of the load parameter in statics; along an arc length no step is longer
    than the linear response to that increment; modes have none.
    """

    mesh: Annotated[tuple[Count, Count], Pair]
    points: Annotated[tuple[Count, Count, Count], Triple] = (7, 7, 3)
    integration: Literal["subdomain", "sparing", "global"] = "subdomain"
    contact_points: Annotated[tuple[Count, Count], Pair] | None = None
    element: Literal["conforming", "acm", "enriched"] = "enriched"
    fit: tuple[Positive, ...] | None = None
    enrich: Annotated[Positive, Field(lt=1)] | None = None
    walls: bool = False
    lips: bool = False
    volumetric: Literal["relaxed", "reduced", "full"] | None = None
    integrator: Literal["trapezoidal", "generalized-alpha", "energy-momentum"] = "trapezoidal"
    time_step: Positive | None = None
    budget: Budget = "standard"


class ReferenceLevel(Part):
    """One resolution of the tetrahedral reference: largest edge length `size` (m), time step (s; modes have none).

    error_per_step: the displacement error (m) that a time step may add at any node. Where it is stated,
    time_step is the largest step, and a step of larger estimated error is repeated with a smaller one.
    """

    size: Positive
    integrator: Literal["trapezoidal", "generalized-alpha"] = "trapezoidal"
    time_step: Positive | None = None
    error_per_step: Positive | None = None
    budget: Budget = "standard"


Level = AncfLevel | ReferenceLevel


def _inherit(ladder: Any) -> Any:
    """Copy the keys stated beside `levels` into each level that does not state them itself."""
    if not isinstance(ladder, dict) or not isinstance(ladder.get("levels"), (list, tuple)):
        return ladder
    common = {key: value for key, value in ladder.items() if key != "levels"}
    levels = [{**common, **level} if isinstance(level, dict) else level for level in ladder["levels"]]
    return {"levels": levels}


Inherited = BeforeValidator(_inherit)


class AncfLadder(Part):
    """Levels of the ANCF solver; defaults stated beside them hold for every level."""

    levels: tuple[AncfLevel, ...] = Field(min_length=1)


class ReferenceLadder(Part):
    """Levels of the reference solver; defaults stated beside them hold for every level."""

    levels: tuple[ReferenceLevel, ...] = Field(min_length=1)


class PublishedRow(Part):
    """A printed value (m) for one ANCF mesh; `points` is the quadrature rule that row was found to use."""

    mesh: Annotated[tuple[Count, Count], Pair]
    value: Number
    cell: str
    points: Annotated[tuple[Count, Count, Count], Triple] | None = None


class PublishedValue(Part):
    """A printed converged value (m) and the cell it came from."""

    value: Number
    cell: str


class Published(Part):
    """Published heights (m) of the answer probe."""

    source: str
    rows: tuple[PublishedRow, ...] = ()
    converged: PublishedValue | None = None


class Variant(Part):
    """The scene again with some keys set otherwise, to show how much an assumption matters."""

    name: str
    set: dict[str, Any]


class Sensitivity(Part):
    """Variants and the one level per solver at which they are compared with the scene itself."""

    budget: Budget = "standard"
    ancf: AncfLevel | None = None
    reference: ReferenceLevel | None = None
    variants: tuple[Variant, ...] = Field(min_length=1)


class Scene(Part):
    """The whole question. See the module's docstring for coordinates and units.

    grooves: those stated, and after them those of the tread, whose names begin with "tread ".
    surface_stress: whether each solver also states the von Mises stress on its surface at the last output.
    answer: what tables and pages compare of the first probe at the last output: its height, the coordinate z, or a
    component of its displacement.
    """

    schema_version: Literal[1] = SCHEMA
    name: str
    title: str
    source: str = ""
    assumed: tuple[str, ...] = ()
    study: str = "scene"
    companions: tuple[str, ...] = ()
    surface: Surface
    thickness: Positive
    grooves: tuple[Feature, ...] = ()
    protrusions: tuple[Feature, ...] = ()
    tread: Tread | None = None
    material: Material
    supports: tuple[Support, ...] = ()
    rim: Rim | None = None
    loads: tuple[Load, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    initial: Initial | None = None
    probes: tuple[Probe, ...] = ()
    surface_stress: bool = False
    answer: Literal["height", "u_x", "u_y", "u_z"] = "height"
    analysis: Annotated[Analysis | Modes, Field(discriminator="kind")]
    ancf: Annotated[AncfLadder, Inherited] | None = None
    reference: Annotated[ReferenceLadder, Inherited] | None = None
    published: Published | None = None
    sensitivity: Sensitivity | None = None

    def ladder(self, solver: str, budget: str = "full") -> tuple[Level, ...]:
        """Levels of `solver` ("ancf" or "reference") that the budget pays for."""
        ladder = getattr(self, solver)
        paid = BUDGETS[: BUDGETS.index(budget) + 1]
        return () if ladder is None else tuple(level for level in ladder.levels if level.budget in paid)

    def physics(self) -> dict[str, Any]:
        """The scene as plain JSON values without what no solver reads: titles, ladders, published values."""
        unread = {
            "title",
            "tread",
            "source",
            "assumed",
            "study",
            "companions",
            "answer",
            "ancf",
            "reference",
            "published",
            "sensitivity",
            *(("rim",) if self.rim is None else ()),
        }
        return self.model_dump(mode="json", exclude=unread)

    def override(self, changes: dict[str, Any], name: str | None = None) -> Scene:
        """The scene with dotted keys set otherwise, for example {"grooves.0.depth": 0.02}; validated again.

        "ancf.time_step" sets a key in every level of a ladder. Raises SceneError
        where a key does not exist or the changed scene is wrong.
        """
        data = self.model_dump(mode="json", exclude_defaults=True)
        data = {**data, "name": name or self.name}
        if self.tread is not None:
            data["grooves"] = [band for band in data["grooves"] if not band["name"].startswith(PREFIX)]
        try:
            for key, value in changes.items():
                _set(data, key, value)
        except SceneError as error:
            raise SceneError([f"{data['name']}: {problem}" for problem in error.problems]) from error
        return _validated(data, data["name"])


def _set(data: Any, key: str, value: Any) -> None:
    """Set a dotted key in nested dicts and lists; a value of None removes the key."""
    *path, last = key.split(".")
    try:
        for step in path:
            data = data[int(step)] if isinstance(data, list) else data[step]
        if isinstance(data, list):
            data[int(last)] = value
        elif isinstance(data.get("levels"), list) and last != "levels":
            for level in data["levels"]:
                level[last] = value
        elif value is None:
            data.pop(last, None)
        else:
            data[last] = value
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise SceneError([f"{key} = {value!r}: the scene has no such key"]) from error


def parse(data: dict[str, Any], origin: str) -> Scene:
    """Scene from plain values; `origin` (a file's path) begins every problem of the SceneError it may raise."""
    from compare.scene_checks import variant_problems

    scene = _validated(data, origin)
    _refuse(origin, variant_problems(scene))
    return scene


def _validated(data: dict[str, Any], origin: str) -> Scene:
    """Scene whose own values are right; its variants are not tried."""
    from compare.scene_checks import problems

    try:
        scene = Scene.model_validate(data)
    except ValidationError as error:
        raise SceneError([f"{origin}: {problem}" for problem in describe(error, data)]) from error
    if scene.tread is not None:
        scene = _with_tread(scene, origin)
    _refuse(origin, problems(scene))
    return scene


def _with_tread(scene: Scene, origin: str) -> Scene:
    """The scene with the grooves of its tread behind its own; those that were written out with it are these."""
    stated = tread_grooves(scene.tread, scene.surface.span)
    whole = Scene.model_validate({**scene.model_dump(exclude={"grooves"}, exclude_unset=True), "grooves": stated})
    own, written = [], []
    for i, band in enumerate(scene.grooves):
        (written if band.name.startswith(PREFIX) else own).append((i, band))
    if written and tuple(band for _, band in written) != whole.grooves:
        reason = "a tread's grooves have such names; state another"
        _refuse(origin, (f"grooves.{i}.name = {band.name!r}: {reason}" for i, band in written))
    return whole.model_copy(update={"grooves": (*(band for _, band in own), *whole.grooves)})


def _refuse(origin: str, problems: Iterable[str]) -> None:
    found = [f"{origin}: {problem}" for problem in problems]
    if found:
        raise SceneError(found)


def load(scene: str | Path) -> Scene:
    """Scene from a TOML file's path or a shipped scene's name. Raises SceneError."""
    path = Path(scene)
    if not path.suffix:
        path = SHIPPED / f"{scene}.toml"
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        shown = ", ".join(names())
        raise SceneError([f"{scene}: no such scene; give the path of a .toml file or one of: {shown}"]) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError([f"{path}: not a TOML file: {error}"]) from error
    return parse(data, str(path))


def names() -> list[str]:
    """Names of the shipped scenes."""
    return sorted(path.stem for path in SHIPPED.glob("*.toml"))
