"""What a solve of a scene will model and what it leaves out, in words."""

from __future__ import annotations

from compare.scene import ReferenceLevel, Scene

CURVED = {"nurbs": ", carried to the NURBS mid-surface", "revolved": ", carried to the revolved section"}


def words(scene: Scene, level: ReferenceLevel) -> tuple[list[str], list[str]]:
    """What is modelled and what is left out, one line each; counts of unknowns are said to be estimates."""
    small = scene.analysis.kind == "modes"
    strain = "small vibrations about the undeformed one" if small else "total Lagrangian, large rotation and strain"
    curved = CURVED.get(scene.surface.kind, "") + (", closed at its seam" if scene.surface.closed else "")
    modelled = [
        f"quadratic tetrahedra on the solid cut by OCC{curved}; counts are about right until it is meshed",
        f"{_material_words(scene)}, {strain}",
        _marching_words(scene, level),
        *(f"groove {band.name}, cut from the solid" for band in scene.grooves),
        *(f"protrusion {band.name}, fused to the solid" for band in scene.protrusions),
        *(_support_words(support) for support in scene.supports),
        *([] if scene.rim is None else [_rim_words(scene.rim)]),
        *(f"{load.kind} load, {_following(load)}" for load in scene.loads),
        *(_obstacle_words(obstacle) for obstacle in scene.obstacles),
    ]
    left_out = [f"{word}: not in the scene" for word, there in _absent(scene).items() if not there]
    return modelled, [*left_out, "damping of the material"]


def _material_words(scene: Scene) -> str:
    """The law and how it is integrated."""
    if scene.material.kind == "svk":
        return "St. Venant-Kirchhoff solid, exact integration"
    law = "Mooney-Rivlin" if scene.material.mu01 else "neo-Hookean"
    return f"{law} solid; bulk modulus above 20 shear moduli acts on the mean volume of each tetrahedron"


def _following(load) -> str:
    """Whether a load follows the motion."""
    if load.kind == "moment":
        return "turning with its edge"
    return "following its face" if getattr(load, "follower", False) else "dead"


def _support_words(support) -> str:
    """What a support holds."""
    if support.kind == "clamp":
        return f"clamp at {support.edge}: all displacements of the face"
    if support.kind == "symmetry":
        return f"symmetry at {support.edge}: {support.normal} displacements of the face"
    place = support.edge or f"corner {support.corner}"
    where = "everywhere" if support.whole else f"of the {support.over} of {place}"
    return f"hold: {', '.join(support.components)} displacements {where}"


def _rim_words(rim) -> str:
    """What holds the faces of edges as one body."""
    along = f", free along {', '.join(rim.free)}" if rim.free else ""
    turning = f", turned at {list(rim.spin)} rad/s" if any(rim.spin) else ""
    moved = ", moved as stated" if any(rim.displacement) else ""
    return f"rim: the faces of {', '.join(rim.edges)} move as one rigid body{along}{moved}{turning}"


def _obstacle_words(obstacle) -> str:
    """What the plate may touch, and how."""
    friction = f", Coulomb friction {obstacle.friction:g}" if obstacle.friction else ""
    where = "integrated over the true face" if obstacle.law == "pressure" else "at the nodes of the face"
    return f"contact of the {obstacle.face} with the {obstacle.shape.kind} {obstacle.name}: penalty {where}{friction}"


def _marching_words(scene: Scene, level: ReferenceLevel) -> str:
    """How time or load is stepped."""
    step, allowed = level.time_step, level.error_per_step
    if scene.analysis.kind == "modes":
        return f"the {scene.analysis.count} lowest elastic modes, shift-invert Lanczos iteration"
    if scene.analysis.kind == "static":
        return f"statics in load steps of {step:g}"
    chosen = f" at most, each adding no more than {allowed:g} m of estimated error" if allowed else ""
    return f"implicit dynamics, {level.integrator}, steps of {step:g} s{chosen}"


def _absent(scene: Scene) -> dict[str, bool]:
    """What a scene may have, and whether this one does."""
    return {
        "gravity": has_gravity(scene),
        "grooves": bool(scene.grooves),
        "supports": bool(scene.supports or scene.rim),
        "contact": bool(scene.obstacles),
        "initial velocity": scene.initial is not None,
        "inertia": scene.analysis.kind != "static",
    }


def has_gravity(scene: Scene) -> bool:
    """Whether a load needs the mass."""
    return any(load.kind == "gravity" for load in scene.loads)
