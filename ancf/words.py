"""What a solve of a scene will model and what it leaves out, in words."""

from __future__ import annotations

from ancf.shape import FAMILY
from compare.scene import AncfLevel, Scene


def words(scene: Scene, level: AncfLevel) -> tuple[list[str], list[str]]:
    """What is modelled and what is left out, one line each."""
    kind = scene.analysis.kind
    points = "x".join(str(count) for count in level.points)
    coordinates = 3 * len(FAMILY[level.element].kinds)
    per = {"subdomain": "subdomain", "global": "element", "sparing": "element, fewer in narrow parts of it"}
    rule = f"{points} Gauss points per {per[level.integration]}"
    strain = "small vibrations about the undeformed plate" if kind == "modes" else "large rotation and strain"
    modelled = [
        f"fully parameterized {level.element} plate elements ({coordinates} coordinates), {strain}",
        f"{_material_words(scene, level)}, general continuum approach, {rule}",
        _marching_words(scene, level),
    ]
    modelled += [f"groove {band.name}: {_band_words(band)}" for band in scene.grooves]
    modelled += [f"protrusion {band.name}: {_band_words(band)}" for band in scene.protrusions]
    modelled += [_support_words(support) for support in scene.supports]
    modelled += [_rim_words(scene.rim)] if scene.rim is not None else []
    modelled += [_load_words(load) for load in scene.loads]
    modelled += [_obstacle_words(obstacle) for obstacle in scene.obstacles]
    modelled += ["rigid initial velocity"] if scene.initial else []
    modelled += ["grid lines on the edges of grooves and beside them"] if level.fit is not None else []
    if level.enrich is not None:
        modelled += [f"layer functions beyond the grooves' floors, to {level.enrich:g} of the gain that they promise"]
    modelled += ["kinks where the floors of grooves begin and end inside elements"] if level.walls else []
    modelled += ["layers that fade out from those walls beyond the floors"] if level.lips else []
    stated = {
        "grooves": scene.grooves,
        "protrusions": scene.protrusions,
        "supports": scene.supports or scene.rim,
        "gravity": [load for load in scene.loads if load.kind == "gravity"],
        "other loads": [load for load in scene.loads if load.kind != "gravity"],
        "inertia": kind != "static",
    }
    left_out = [f"{name}: the scene states none" for name, parts in stated.items() if not parts]
    left_out += ["material damping, plasticity", *([] if scene.obstacles else ["contact"])]
    left_out += ["warping near groove edges finer than an element"] if level.enrich is None else []
    left_out += _stiffened(scene, level)
    return modelled, left_out


def _material_words(scene: Scene, level: AncfLevel) -> str:
    """The law, and what is done against locking where that is a choice."""
    if scene.material.kind == "svk":
        return "St. Venant-Kirchhoff solid"
    law = "Mooney-Rivlin" if scene.material.mu01 else "neo-Hookean"
    return f"{law} solid, {VOLUMETRIC[level.volumetric or 'relaxed']}"


VOLUMETRIC = {
    "relaxed": "its thickness strain free at each point (normal stress bilinear in the element)",
    "reduced": "its volumetric energy with one point fewer each way",
    "full": "nothing done against volumetric locking",
}


def _stiffened(scene: Scene, level: AncfLevel) -> list[str]:
    """What the element cannot do in bending."""
    material = scene.material
    if material.kind == "svk":
        return [] if FAMILY[level.element].thickness is not None else _stiffened_bending(material.poissons_ratio)
    if level.volumetric in (None, "relaxed"):
        return []
    shear = 2 * (material.mu10 + material.mu01)
    nu = (3 * material.bulk_modulus - 2 * shear) / (6 * material.bulk_modulus + 2 * shear)
    return _stiffened_bending(nu) if level.volumetric == "full" else ["thickness strain that varies with z"]


def _marching_words(scene: Scene, level: AncfLevel) -> str:
    """How the scene's analysis is done."""
    if scene.analysis.kind == "modes":
        return f"the {scene.analysis.count} lowest elastic modes, shift-and-invert Lanczos iteration"
    if scene.analysis.kind == "dynamic":
        return f"implicit dynamics, {level.integrator}, steps of {level.time_step:g} s"
    if scene.analysis.follow == "arc-length":
        return f"static equilibria by arc length, no step longer than the linear response to {level.time_step:g} of t"
    return f"static equilibrium by load steps of {level.time_step:g}"


def _support_words(support) -> str:
    """What a support holds."""
    if support.kind == "clamp":
        return f"clamp of edge {support.edge}, gradients {support.gradients}"
    if support.kind == "symmetry":
        return f"symmetry at edge {support.edge}, normal {support.normal}: the face stays in its plane"
    place = f"edge {support.edge}" if support.edge else f"corner {support.corner}"
    where = "in the whole plate" if support.whole else f"at {place}, over its {support.over}"
    return f"hold of {', '.join(support.components)} {where}"


def _rim_words(rim) -> str:
    """What holds edges and may move."""
    moves = [f"free along {' and '.join(rim.free)}"] if rim.free else []
    moves += ["moved"] if any(rim.displacement) else []
    moves += [f"spinning at {list(rim.spin)} rad/s"] if any(rim.spin) else []
    return f"rigid rim at {' and '.join(rim.edges)}, {', '.join(moves) or 'at rest'}; its bead's directors turn with it"


def _load_words(load) -> str:
    """What a load does."""
    if load.kind == "axle":
        return "load on the rim"
    if load.kind == "pressure":
        return f"pressure on the {load.face} face, {'following it' if load.follower else 'dead'}"
    if load.kind == "moment":
        return f"moment on edge {load.edge} that turns with it"
    return f"{load.kind} load"


def _band_words(band) -> str:
    return f"{band.face} face, " + (f"along {band.along}" if hasattr(band, "along") else "within its outline")


def _obstacle_words(obstacle) -> str:
    """What may be touched."""
    unit = "area" if obstacle.law == "pressure" else "contact point"
    rubs = f", friction {obstacle.friction:g}" if obstacle.friction else ""
    return f"{obstacle.shape.kind} {obstacle.name}: penalty by {unit} on the {obstacle.face} face, one-sided{rubs}"


def _stiffened_bending(nu: float) -> list[str]:
    """What a position field linear in z costs: E_zz cannot follow -nu/(1 - nu) E_xx, which is odd in z.

    Bent to a cylinder, a plate then has the stiffness of lambda + 2 mu instead of E / (1 - nu^2); bent to a bowl,
    alike in both directions, that of 2 (lambda + mu) instead of E / (1 - nu).
    """
    if nu == 0:
        return []
    cylinder, bowl = (1 - nu) ** 2 / (1 - 2 * nu), (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    words = f"on any mesh bending to a cylinder is {cylinder:.3g} times too stiff, to a bowl {bowl:.3g} times"
    return [f"thickness strain that varies with z: {words}"]
