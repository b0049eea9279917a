"""Scene and level -> Model: the words of a scene turned into arrays, before anything is solved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ancf.functional import (
    mean_over_edge,
    mean_over_region,
    mean_through_thickness,
    pressure_on_face,
    slope_through_edge,
    value_at,
)
from ancf.layer import layer_vectors, only, with_layers
from ancf.linear_solver import SingularMatrix
from ancf.loads import EdgeMoment, Load, gravity, pressure, spread
from ancf.material import MooneyRivlin, SaintVenantKirchhoff, from_engineering
from ancf.mesh import Mesh, grid
from ancf.modes import free_motions
from ancf.nurbs import Curve, Revolved, Surface, surface_derivatives
from ancf.pressure import FollowerPressure, follower_pressure
from ancf.refine import band_edges, chosen, fitted
from ancf.shape import FAMILY
from ancf.subdomain import BOTTOM, GROOVE, PROTRUSION, TOP, Band, Feature, Outlined, element_rule
from ancf.supports import clamp, free_edges, hold_corner, hold_edge, hold_whole, symmetry
from ancf.system import RELAXED, Body, System, body, system
from ancf.volume_ratio import VolumeRatio, volume_ratio
from ancf.wall import with_walls
from compare.scene import AncfLevel, Scene
from compare.scene import Feature as SceneFeature

if TYPE_CHECKING:
    from ancf import contact
    from ancf.rim import Rim

SAME = 0.01  # of the thickness: edges this near to each other share a grid line
LENGTH_POINTS = 65


@dataclass(frozen=True, eq=False)
class Model:
    """A scene unpacked: geometry, body, system, probes as rows (p, v), and the points whose det F is asked for."""

    mesh: Mesh
    bands: tuple[Feature, ...]
    body: Body
    system: System
    probes: np.ndarray
    ratios: tuple[VolumeRatio, ...]


def build(scene: Scene, level: AncfLevel) -> Model:
    """Mesh, integrate and assemble the scene. Raises GeometryError, SingularMatrix where loads cannot choose layers."""
    bands, mesh = bands_of(scene), mesh_of(scene, level)
    if level.enrich is None or not bands:
        return _model(scene, level, mesh, bands)
    every = with_layers(mesh, layer_vectors(mesh, bands, scene.thickness), bands, scene.thickness)
    inertia = scene.analysis.until**-2 if scene.analysis.kind == "dynamic" else 0.0
    trial = _model(scene, level, every, bands, once=True)
    if why := loose(scene, trial.system):
        raise SingularMatrix(why)
    worth = chosen(trial.system, level.enrich, inertia)
    return _model(scene, level, only(every, worth), bands)


def loose(scene: Scene, acting: System) -> str:
    """Which rigid motions statics leaves free, "" where there is none or an obstacle or a rim may stop it.

    Round-off of the tangent would tell them on some meshes alone, and give arbitrary displacements on others.
    """
    if scene.analysis.kind != "static" or acting.contact is not None or acting.rim is not None:
        return ""
    count = len(free_motions(acting))
    many = "1 rigid motion is" if count == 1 else f"{count} rigid motions are"
    return f"{many} free: the supports do not hold the plate" if count else ""


def _model(scene: Scene, level: AncfLevel, mesh: Mesh, bands: tuple[Feature, ...], once: bool = False) -> Model:
    material = material_of(scene)
    density = scene.material.density or 0.0
    held, rim = held_of(scene, mesh), rim_of(scene, mesh)
    free = free_edges(mesh, held if rim is None else held | rim.held | rim.tied)
    volume = level.volumetric or RELAXED
    integration = level.points, level.integration, False, free, volume, once
    plate = body(mesh, bands, scene.thickness, material, density, *integration)
    loads = [_load(load, mesh, bands, scene.thickness, plate, rim) for load in scene.loads]
    kinds = Load, EdgeMoment, FollowerPressure
    dead, *following = ([load for load in loads if isinstance(load, kind)] for kind in kinds)
    probes = [_probe(probe, mesh, bands, scene.thickness) for probe in scene.probes]
    acting = system(plate, held, dead, scene.thickness, *following, rim)
    if scene.obstacles:
        acting = replace(acting, contact=_obstacles(scene, level, mesh, bands, acting))
    return Model(mesh, bands, plate, acting, np.array(probes), tuple(_ratios(scene, level, mesh, bands, plate)))


def material_of(scene: Scene) -> SaintVenantKirchhoff | MooneyRivlin:
    stated = scene.material
    if stated.kind == "svk":
        return from_engineering(stated.youngs_modulus, stated.poissons_ratio)
    return MooneyRivlin(stated.mu10, stated.mu01, stated.bulk_modulus)


def mesh_of(scene: Scene, level: AncfLevel) -> Mesh:
    surface = _surface(scene)
    mesh = grid(*_lines(scene, level, surface), surface, FAMILY[level.element], scene.surface.closed)
    return with_walls(mesh, bands_of(scene), scene.thickness if level.lips else None) if level.walls else mesh


def _surface(scene: Scene) -> Surface | Revolved | None:
    """The mid-surface, None where it is flat."""
    stated = scene.surface
    if stated.kind == "nurbs":
        return Surface(stated.degree, stated.knots, stated.control_points, stated.weights)
    if stated.kind == "revolved":
        section = stated.section
        curve = Curve(section.degree, section.knots, section.control_points, section.weights)
        return Revolved(curve, "XYZ".index(stated.axis))
    return None


def _lines(scene: Scene, level: AncfLevel, surface: Surface | Revolved | None) -> Iterator[np.ndarray]:
    """Grid lines of each axis."""
    for axis, (span, count) in enumerate(zip(scene.surface.span, level.mesh, strict=True)):
        if level.fit is None:
            yield np.linspace(*span, count + 1)
        else:
            metre = 1.0 if surface is None else np.ptp(span) / _length(scene, surface, axis)
            unit = scene.thickness * metre
            beside = [distance * unit for distance in level.fit]
            yield fitted(span, count, band_edges(bands_of(scene), axis), beside, SAME * unit)


def _length(scene: Scene, surface: Surface | Revolved, axis: int) -> float:
    """Length (m) of the surface's middle line along an axis."""
    spans = scene.surface.span
    at = [np.full(LENGTH_POINTS, np.mean(span)) for span in spans]
    at[axis] = np.linspace(*spans[axis], LENGTH_POINTS)
    return float(np.linalg.norm(np.diff(surface_derivatives(surface, *at).s, axis=0), axis=1).sum())


def held_of(scene: Scene, mesh: Mesh) -> np.ndarray:
    """Held components (3 v,)."""
    held = np.zeros(3 * len(mesh.vectors), dtype=bool)
    for support in scene.supports:
        held |= _support(support, mesh)
    return held


def rim_of(scene: Scene, mesh: Mesh) -> Rim | None:
    """The rim, where the scene has one; its code is loaded only here."""
    if scene.rim is None:
        return None
    from ancf.rim import rim

    stated = scene.rim
    free = ["XYZ".index(component) for component in stated.free]
    motion = stated.mass, stated.displacement, stated.history, stated.spin
    return rim(mesh, stated.edges, free, held_of(scene, mesh), *motion)


def _support(support, mesh: Mesh) -> np.ndarray:
    """Held components (3 v,) of one support."""
    if support.kind == "clamp":
        return clamp(mesh, support.edge, support.gradients)
    if support.kind == "symmetry":
        return symmetry(mesh, support.edge, "XYZ".index(support.normal))
    components, face = ["XYZ".index(component) for component in support.components], support.over == "face"
    if support.whole:
        return hold_whole(mesh, components)
    if support.over not in ("face", "middle"):
        raise ValueError(f"a plate cannot hold the {support.over} of an edge apart from its face")
    if support.edge is not None:
        return hold_edge(mesh, support.edge, components, face)
    return hold_corner(mesh, (int(support.corner[1]), int(support.corner[3])), components, face)


def bands_of(scene: Scene) -> tuple[Feature, ...]:
    grooves = [_band(band, GROOVE) for band in scene.grooves]
    return (*grooves, *(_band(band, PROTRUSION) for band in scene.protrusions))


def _band(band: SceneFeature, sign: int) -> Feature:
    face = _side(band.face)
    if hasattr(band, "outline"):
        loop, surface = band.outline, band.depth_surface
        outline = Curve(loop.degree, loop.knots, loop.control_points, loop.weights)
        depth = band.depth
        if surface is not None:
            depth = Surface(surface.degree, surface.knots, np.array(surface.depths)[..., None])
        return Outlined(face, sign, outline, depth)
    profile = band.profile
    section = band.depth
    if profile is not None:
        section = Curve(profile.degree, profile.knots, profile.control_points, profile.weights)
    along = {} if band.extent is None else {"extent": band.extent}
    return Band(face, sign, "xy".index(band.along), band.edges, section, **along)


def _side(face: str) -> int:
    """BOTTOM or TOP."""
    return BOTTOM if face == "bottom" else TOP


def _load(
    load, mesh: Mesh, bands, thickness: float, plate: Body, rim: Rim | None
) -> Load | EdgeMoment | FollowerPressure:
    if load.kind == "gravity":
        mass_row = plate.mass_row if rim is None else plate.mass_row + rim.mass * rim.row
        return gravity(mass_row, load.acceleration, load.history)
    if load.kind == "axle":
        return spread(rim.row, load.force, load.history)
    if load.kind == "pressure":
        face = _side(load.face)
        if load.follower:
            return follower_pressure(mesh, thickness, face, load.pressure, load.history)
        row = pressure_on_face(mesh, thickness, face)
        return pressure(row, load.pressure, load.history)
    if load.kind == "moment":
        row = slope_through_edge(mesh, bands, thickness, load.edge)
        return EdgeMoment(row, np.array(load.moment), tuple(load.history))
    if load.kind == "point":
        row = mean_through_thickness(mesh, bands, thickness, *load.at)
    elif load.kind == "edge":
        row = mean_over_edge(mesh, bands, thickness, load.edge)
    else:
        row = mean_over_region(mesh, bands, thickness, load.region)
    return spread(row, load.force, load.history)


def _obstacles(scene: Scene, level: AncfLevel, mesh: Mesh, bands, acting: System) -> contact.Contact:
    """What each obstacle may touch; the code of contact is loaded only here."""
    from ancf import obstacle as rigid
    from ancf.contact import Contact, Pair
    from ancf.contact_law import Law
    from ancf.face import face

    def body(shape):
        if shape.kind == "plane":
            return rigid.plane(shape.point, shape.normal)
        if shape.kind == "sphere":
            return rigid.sphere(shape.centre, shape.radius)
        return rigid.drum(shape.point, shape.axis, shape.radius)

    counts = level.contact_points or level.points[:2]
    faces = {
        side: face(mesh, bands, scene.thickness, counts, _side(side), acting.assembly, level.integration)
        for side in {stated.face for stated in scene.obstacles}
    }
    pairs = []
    for stated in scene.obstacles:
        own = faces[stated.face]
        k, c = stated.stick_stiffness, stated.stick_damping
        sticks = (stated.stiffness if k is None else k, stated.damping if c is None else c)
        law = Law(stated.stiffness, stated.damping, stated.friction, *sticks)
        share = own.share if stated.law == "pressure" else np.ones(len(own.share))
        pairs.append(Pair(own, body(stated.shape), law, share))
    return Contact(tuple(pairs))


def _probe(probe, mesh: Mesh, bands, thickness: float) -> np.ndarray:
    if hasattr(probe, "region"):
        return mean_over_region(mesh, bands, thickness, probe.region)
    return value_at(mesh, *probe.at)


def _ratios(scene: Scene, level: AncfLevel, mesh: Mesh, bands, plate: Body) -> Iterator[VolumeRatio]:
    """The points whose det F the scene asks for."""
    for probe in scene.probes:
        if getattr(probe, "volume_ratio", False):
            e = mesh.locate(*probe.at[:2])
            rule = element_rule(mesh.cells[e], bands, scene.thickness, level.points, level.integration, mesh.levels(e))
            yield volume_ratio(mesh, plate.elements, probe.at, rule)


def initial_velocity(scene: Scene, model: Model) -> np.ndarray:
    """Components (3 v,) of a rigid velocity; held components rest, and what a rim holds moves with it."""
    mesh, v = model.mesh, np.zeros((len(model.mesh.vectors), 3))
    if scene.initial is not None:
        is_position = (mesh.kinds == "r")[:, None]
        v = np.cross(scene.initial.angular_velocity, mesh.vectors) + is_position * np.array(scene.initial.velocity)
    v, rim = v.ravel(), model.system.rim
    v[model.system.assembly.unknown_of < 0] = 0.0
    return v if rim is None else rim.placed(v, rim.motion(0.0).v)
