"""What a scene may not say although each key alone is well formed: geometry, material, times."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from compare.scene import Analysis, AncfLevel, Feature, Interval, Level, Outlined, Region, Scene, names
from compare.scene_errors import SceneError
from compare.scene_geometry import AXES, all_bands, band_problems, limits, material_range, off_plane, surface_problems
from compare.scene_parts import History, Support
from compare.scene_revolved import seam_problems
from compare.scene_rim_checks import rim_problems
from compare.scene_symmetry import symmetry_problems

WHOLE = 1e-9  # relative: how far a ratio of two times may lie from a whole number
ROUND_OFF = 1e-12  # of a length
TIMELESS = {
    "loads": "small vibrations about the undeformed plate, which no load has bent",
    "initial": "found without a motion",
    "obstacles": "small vibrations of a plate that touches nothing",
    "probes": "told by their frequencies and have no height",
    "published": "told by their frequencies, published values are heights",
}
STEPLESS = (
    ("error_per_step", None, "statics adds no error per step"),
    ("integrator", "trapezoidal", "statics has no motion to integrate"),
)
TAKEN = ("index", "sweep", "speed", "hard_cases", "integration", "plate_drop", "tire", "tire_solids")  # by other pages
CLAMPED = "this edge is already clamped by {first}"
LEAST_POINTS = {"enriched": (4, 4, 3)}  # of elements that deform without energy below them
SHARED = 0.01  # of the thickness: edges this near to an end of the plate share its grid line


def problems(scene: Scene) -> Iterator[str]:
    """Problems of the scene but for its variants, each as "key = value: reason"."""
    yield from _file_names(scene)
    yield from _repeated_names(scene)
    surface = list(surface_problems(scene))
    yield from surface
    if not surface:
        bands = list(band_problems(scene))
        yield from bands
        yield from seam_problems(scene)
        yield from _misplaced_loads(scene)
        askew = list(_askew_symmetries(scene))
        yield from askew or symmetry_problems(scene)
        yield from _misplaced_probes(scene, with_bands=not bands)
    timed = (_probes, _pressures_and_moments, _histories, _initial, _times, _path)
    checks = (_material, _elements, _supports, _obstacles, _stress)
    checks += timed if scene.analysis.kind != "modes" else (_timeless,)
    for check in (*checks, _points, _unloaded, _ladders, _published, _companions, _sensitivity):
        yield from check(scene)
    yield from rim_problems(scene, list(_levels(scene)))


def _file_names(scene: Scene) -> Iterator[str]:
    """Names that become files and modules: nothing in them may lead elsewhere."""
    if not re.fullmatch(r"\w[\w .+-]{0,99}", scene.name):
        yield f"name = {scene.name!r}: it names files; use 1 to 100 letters, digits, spaces and _ . + -, no . first"
    elif scene.name in TAKEN:
        yield f"name = {scene.name!r}: a page or an accepted table that is no scene's has this name; state another"
    if not scene.study.isidentifier():
        yield f"study = {scene.study!r}: not the name of an exhibit"


def _repeated_names(scene: Scene) -> Iterator[str]:
    bands = [(f"{key}.name", band.name) for key, band in all_bands(scene)]
    probes = [(f"probes.{i}.name", probe.name) for i, probe in enumerate(scene.probes)]
    for named in (bands, probes):
        yield from _repeated(named, "this name is already taken by {first}")


def _repeated(named: Iterable[tuple[str, object]], reason: str) -> Iterator[str]:
    """Entries (key, value) whose value an earlier one has."""
    seen = {}
    for key, value in named:
        if value in seen:
            yield f"{key} = {_plain(value)}: {reason.format(first=seen[value])}"
        seen.setdefault(value, key)


def _misplaced_loads(scene: Scene) -> Iterator[str]:
    for i, load in enumerate(scene.loads):
        if load.kind == "point":
            yield from _off_plate(scene, f"loads.{i}.at", load.at)
        elif load.kind == "patch":
            yield from _empty_region(scene, f"loads.{i}.region", load.region)


def _misplaced_probes(scene: Scene, with_bands: bool) -> Iterator[str]:
    for i, probe in enumerate(scene.probes):
        if hasattr(probe, "region"):
            yield from _empty_region(scene, f"probes.{i}.region", probe.region)
            continue
        off = list(_off_plate(scene, f"probes.{i}.at", probe.at))
        yield from off
        if not off and with_bands:
            yield from _outside_material(scene, f"probes.{i}.at", probe.at)


def _off_plate(scene: Scene, key: str, at: Sequence[float]) -> Iterator[str]:
    for axis, (first, last) in enumerate(scene.surface.span):
        slack = ROUND_OFF * (last - first)
        if not first - slack <= at[axis] <= last + slack:
            yield f"{key} = {_plain(at)}: off the plate, whose {AXES[axis]} runs from {first:g} to {last:g}"


def _outside_material(scene: Scene, key: str, at: Sequence[float]) -> Iterator[str]:
    low, high = material_range(scene, at[0], at[1])
    slack = ROUND_OFF * scene.thickness
    if not low - slack <= at[2] <= high + slack:
        yield f"{key} = {_plain(at)}: outside the material, whose z runs from {low:g} to {high:g} m there"


def _empty_region(scene: Scene, key: str, region: Region) -> Iterator[str]:
    for axis, ((low, high), (first, last)) in enumerate(zip(region, scene.surface.span, strict=True)):
        if not low < high:
            yield f"{key}.{axis} = [{low:g}, {high:g}]: the first coordinate must be less than the second"
        elif low >= last or high <= first:
            plate = f"whose {AXES[axis]} runs from {first:g} to {last:g}"
            yield f"{key}.{axis} = [{low:g}, {high:g}]: off the plate, {plate}"


def _material(scene: Scene) -> Iterator[str]:
    nu, key = getattr(scene.material, "poissons_ratio", 0.0), "material.poissons_ratio"
    if nu == 0.5:
        yield f"{key} = 0.5: an incompressible St. Venant-Kirchhoff solid is singular; state -1 < nu < 0.5"
    elif not -1 < nu < 0.5:
        yield f"{key} = {nu:g}: no stable elastic solid; state -1 < nu < 0.5"
    if scene.material.density is None:
        inertial = {"dynamic": "dynamics", "modes": "vibration"}
        reasons = [inertial[kind] for kind in inertial if kind == scene.analysis.kind]
        reasons += ["gravity"] * any(load.kind == "gravity" for load in scene.loads)
        if reasons:
            yield f"material.density: this key is missing; {' and '.join(reasons)} cannot do without mass"


def _elements(scene: Scene) -> Iterator[str]:
    """What levels state that the material has no use for, or no scheme."""
    for key, level in _levels(scene):
        if getattr(level, "walls", False) and level.enrich is not None:
            yield f"{key}.walls = true: elements have wall functions or layers (enrich), not both; leave one out"
        if getattr(level, "lips", False) and not level.walls:
            yield f"{key}.lips = true: what ends at walls needs them; state walls = true as well, or leave this out"
        if getattr(level, "contact_points", None) is not None and not scene.obstacles:
            yield f"{key}.contact_points = {list(level.contact_points)}: the scene has no obstacle; leave this out"
        stated = getattr(level, "volumetric", None)
        if scene.material.kind == "svk":
            if stated is not None:
                yield f"{key}.volumetric = {stated!r}: for material.kind = 'mooney-rivlin' alone; leave this out"
            continue
        if level.integrator == "energy-momentum":
            reason = "keeps the energy of an svk solid alone; state 'trapezoidal' or 'generalized-alpha'"
            yield f"{key}.integrator = 'energy-momentum': {reason}"
        if getattr(level, "enrich", None) is not None:
            yield f"{key}.enrich = {level.enrich:g}: its indicator is that of an svk solid; leave this out"


def _supports(scene: Scene) -> Iterator[str]:
    clamped = {f"supports.{i}.edge": clamp.edge for i, clamp in enumerate(scene.supports) if clamp.kind == "clamp"}
    yield from _repeated(clamped.items(), CLAMPED)
    for i, support in enumerate(scene.supports):
        if support.kind != "clamp" and support.edge in clamped.values():
            first = next(key for key, edge in clamped.items() if edge == support.edge)
            yield f"supports.{i}.edge = {support.edge!r}: {CLAMPED.format(first=first)}"
        if support.kind == "hold":
            yield from _held(scene, i)
    if scene.analysis.kind == "static" and not scene.supports and scene.rim is None:
        yield "supports = []: statics without a support is singular; clamp an edge"


def _obstacles(scene: Scene) -> Iterator[str]:
    yield from _repeated(
        [(f"obstacles.{i}.name", obstacle.name) for i, obstacle in enumerate(scene.obstacles)],
        "this name is already taken by {first}",
    )
    for i, obstacle in enumerate(scene.obstacles):
        key = f"obstacles.{i}"
        for name in ("normal", "axis"):
            if not any(getattr(obstacle.shape, name, (1.0,))):
                yield f"{key}.shape.{name} = {_plain(getattr(obstacle.shape, name))}: needs a direction"
        for name in ("stick_stiffness", "stick_damping"):
            if getattr(obstacle, name) is not None and obstacle.friction == 0:
                yield f"{key}.{name} = {getattr(obstacle, name):g}: nothing sticks without friction; leave this out"
        for name in ("damping", "stick_damping") if scene.analysis.kind == "static" else ():
            if getattr(obstacle, name):
                yield f"{key}.{name} = {getattr(obstacle, name):g}: statics has no velocity; leave this out"
        if getattr(scene.analysis, "follow", "load") == "arc-length":
            yield f"{key}: an arc length follows dead loads only; state analysis.follow = 'load'"


def _timeless(scene: Scene) -> Iterator[str]:
    """What a scene of modes states in vain: they are of the unloaded plate, have no time and no height."""
    stated = {
        "loads": scene.loads,
        "obstacles": scene.obstacles,
        "initial": scene.initial,
        "probes": scene.probes,
        "published": scene.published,
    }
    for key, value in stated.items():
        if value:
            yield f"{key}: modes are {TIMELESS[key]}; leave this out or state another analysis.kind"
    for key, level in _levels(scene):
        for name, nothing in (("time_step", None), ("error_per_step", None), ("integrator", "trapezoidal")):
            if (value := getattr(level, name, nothing)) != nothing:
                yield f"{key}.{name} = {_plain(value)}: modes take no steps in time; leave this out"


def _probes(scene: Scene) -> Iterator[str]:
    if not scene.probes:
        yield "probes = []: needs at least one entry"


def _held(scene: Scene, i: int) -> Iterator[str]:
    """Problems of a hold."""
    hold = scene.supports[i]
    places = [(key, getattr(hold, key)) for key in ("edge", "corner", "whole") if getattr(hold, key)]
    if not places:
        yield f"supports.{i}.edge: this key is missing; a hold needs edge, corner, or whole = true"
    for key, value in places[1:]:
        yield f"supports.{i}.{key} = {value!r}: state one of edge, corner and whole"
    if hold.whole and hold.over != "face":
        yield f"supports.{i}.over = {hold.over!r}: a plate held as a whole has no such part; leave this out"
    if scene.ancf is not None and hold.over in ("bottom", "top"):
        key = f"supports.{i}.over = {hold.over!r}"
        yield f"{key}: a plate holds its face or its middle; state one of these, or no ancf ladder"


def _askew_symmetries(scene: Scene) -> Iterator[str]:
    for i, support in enumerate(scene.supports):
        if support.kind == "symmetry" and (reason := off_plane(scene, support.edge, support.normal)):
            yield f"supports.{i}.normal = {support.normal!r}: {reason}"


def _pressures_and_moments(scene: Scene) -> Iterator[str]:
    for i, load in enumerate(scene.loads):
        if load.kind == "pressure":
            bands = [(key, band) for key, band in all_bands(scene) if band.face == load.face]
            for key, _ in bands[:1]:
                yield f"loads.{i}.face = {load.face!r}: {key} lies on it; a pressure on a grooved face is not modelled"
            if load.follower:
                yield from _follower(scene, i)
        elif load.kind == "moment":
            yield from _moment(scene, i)


def _follower(scene: Scene, i: int) -> Iterator[str]:
    """Schemes that take dead loads alone."""
    for key, level in _levels(scene):
        if level.integrator == "energy-momentum":
            reason = "takes dead loads only; state 'trapezoidal' or 'generalized-alpha'"
            yield f"{key}.integrator = 'energy-momentum': with loads.{i}.follower it {reason}"


def _moment(scene: Scene, i: int) -> Iterator[str]:
    moment, key = scene.loads[i].moment, f"loads.{i}.moment = {_plain(scene.loads[i].moment)}"
    if scene.analysis.kind != "static":
        yield f"{key}: a moment that follows its edge is modelled in statics only; state analysis.kind = 'static'"
    if not any(moment):
        yield f"{key}: a moment without a direction has no axis; leave this load out"
    elif scene.surface.kind == "rectangle" and not any(moment[:2]):
        yield f"{key}: its axis is the director of the edge, which a moment about it cannot turn"


def _histories(scene: Scene) -> Iterator[str]:
    for i, load in enumerate(scene.loads):
        times = [time for time, _ in load.history]
        if not times:
            yield f"loads.{i}.history = []: needs at least one pair of time and factor"
        for j, (before, time) in enumerate(pairwise(times), start=1):
            if time <= before:
                yield f"loads.{i}.history.{j} = {_plain(load.history[j])}: its time must be later than {before:g}"


def _initial(scene: Scene) -> Iterator[str]:
    if scene.initial is not None and scene.analysis.kind == "static":
        yield "initial: statics has no velocity; leave this out or state analysis.kind = 'dynamic'"


def _times(scene: Scene) -> Iterator[str]:
    levels = list(_levels(scene))
    yield from (f"{key}.time_step: this key is missing" for key, level in levels if level.time_step is None)
    if scene.analysis.kind == "static":
        yield from _steps_of_statics(levels)
    if scene.analysis.follow == "arc-length":
        return
    until, every = scene.analysis.until, scene.analysis.every
    if not _is_multiple(until, every):
        yield f"analysis.until = {until:g}: not a whole multiple of analysis.every = {every:g}"
    steps = {}  # of the levels with one time step the first is named
    for key, level in levels:
        if level.time_step is not None:
            steps.setdefault((key.split(".levels")[0], level.time_step), key)
    for (_, step), key in steps.items():
        if not _is_multiple(every, step):
            yield f"{key}.time_step = {step:g}: analysis.every = {every:g} is not a whole multiple of it"


def _steps_of_statics(levels: Sequence[tuple[str, Level]]) -> Iterator[str]:
    """What levels state of steps in time, which statics does not take; of the levels the first is named."""
    for name, nothing, reason in STEPLESS:
        stated = [(key, getattr(level, name, nothing)) for key, level in levels]
        first = [(key, value) for key, value in stated if value != nothing][:1]
        yield from (f"{key}.{name} = {_plain(value)}: {reason}; leave this out" for key, value in first)


def _path(scene: Scene) -> Iterator[str]:
    """What an arc length cannot follow."""
    if scene.analysis.follow == "load":
        return
    key = "analysis.follow = 'arc-length'"
    if scene.analysis.kind == "dynamic":
        yield f"{key}: dynamics follows time; leave this out or state analysis.kind = 'static'"
    if scene.analysis.every != Analysis.model_fields["every"].default:
        yield f"analysis.every = {scene.analysis.every:g}: along an arc length every step is an output; leave this out"
    if scene.reference is not None or getattr(scene.sensitivity, "reference", None) is not None:
        yield f"{key}: the reference follows the load alone; state levels of ancf only"
    for i, load in enumerate(scene.loads):
        yield from _bent(f"loads.{i}.history", load.history, scene.analysis.until)
        if load.kind == "moment":
            yield f"loads.{i}.kind = 'moment': an arc length follows dead loads only; state analysis.follow = 'load'"
        if getattr(load, "follower", False):
            yield f"loads.{i}.follower = True: an arc length follows dead loads only; state analysis.follow = 'load'"
    if not any(len({factor for _, factor in load.history}) > 1 for load in scene.loads):
        yield f"{key}: no load grows with the load parameter; state the history of one, [[0, 0], [1, 1]]"


def _stress(scene: Scene) -> Iterator[str]:
    if scene.answer != "height" and (scene.analysis.kind == "modes" or scene.published):
        reason = "modes are told by their frequencies" if scene.analysis.kind == "modes" else "published are heights"
        yield f"answer = {scene.answer!r}: {reason}; leave this out"
    if scene.surface_stress and scene.analysis.kind == "modes":
        yield "surface_stress = True: a mode has no size and so no stress; leave this out"
    if scene.surface_stress and scene.material.kind != "svk":
        yield f"surface_stress = True: told for material.kind = 'svk' only, not for {scene.material.kind!r}"


def _bent(key: str, history: History, until: float) -> Iterator[str]:
    """The first point of a history that is no straight line from t = 0 to `until`."""
    for j, (time, _) in enumerate(history if len(history) > 1 else ()):
        if (j == 0 and time != 0) or 0 < time < until:
            line = f"one straight line from t = 0 to analysis.until = {until:g}"
            yield f"{key}.{j} = {_plain(history[j])}: along an arc length a load is constant or {line}"
            return


def _points(scene: Scene) -> Iterator[str]:
    for key, level in _levels(scene):
        least = _least_points(scene, level)
        points = getattr(level, "points", least)
        if any(count < few for count, few in zip(points, least, strict=True)):
            reason = f"the {level.element} element deforms without energy below {list(least)}"
            yield f"{key}.points = {list(points)}: {reason}; state that or more, or another element"
        if getattr(level, "volumetric", None) == "reduced" and min(points) < 2:
            reason = "volumetric = 'reduced' takes one point fewer each way, and none would be left"
            yield f"{key}.points = {list(points)}: {reason}; state 2 or more each way"


def _unloaded(scene: Scene) -> Iterator[str]:
    """Levels that ask for unknowns where a load wants them, in a scene without one."""
    for key, level in _levels(scene):
        if getattr(level, "enrich", None) is not None and not scene.loads:
            yield f"{key}.enrich = {level.enrich:g}: its indicator needs a load, and the scene states none"


def _least_points(scene: Scene, level: Level) -> tuple[int, int, int]:
    """Gauss points that the level's element needs; one more across elements between two free edges, which have a layer
    of svk on each."""
    least = LEAST_POINTS.get(getattr(level, "element", ""), (1, 1, 1))
    if least == (1, 1, 1) or level.integration == "global" or scene.material.kind != "svk":
        return least
    free = _free_edges(scene)
    between = ({f"{axis}0", f"{axis}1"} <= free and not _is_divided(scene, level, k) for k, axis in enumerate(AXES))
    return tuple(few + more for few, more in zip(least, (*between, 0), strict=True))


def _free_edges(scene: Scene) -> set[str]:
    """Edges of the plate along which nothing holds the director; a line of its middle or a corner does not."""
    held = set(scene.rim.edges if scene.rim else ())
    for support in scene.supports:
        if support.kind != "hold" or support.over == "face":
            held |= {f"{axis}{end}" for axis in AXES for end in "01"} if _is_whole(support) else {support.edge}
    return {f"{axis}{end}" for axis in AXES[scene.surface.closed :] for end in "01"} - held


def _is_whole(support: Support) -> bool:
    return support.kind == "hold" and support.whole


def _is_divided(scene: Scene, level: AncfLevel, axis: int) -> bool:
    """Whether there is more than one element along an axis, for lines of the mesh or those that `fit` adds at edges.

    Edges within SHARED of the thickness of the plate's ends add none; on a curved plate, whose length is not looked up
    here, those within as much of the whole side are not relied on.
    """
    if level.mesh[axis] > 1 or level.fit is None:
        return level.mesh[axis] > 1
    if any(surface_problems(scene)) or any(band_problems(scene)):
        return True  # refused for these, which may have no edges
    first, last = scene.surface.span[axis]
    apart = SHARED * (scene.thickness if scene.surface.kind == "rectangle" else last - first)
    edges = (edge for _, band in all_bands(scene) for edge in _ends(scene, band, axis))
    return any(first + apart < edge < last - apart for edge in edges)


def _ends(scene: Scene, band: Feature, axis: int) -> Interval:
    """Least and greatest coordinate of a feature on an axis."""
    return band.limits(axis) if isinstance(band, Outlined) else limits(scene, band, axis)


def _is_multiple(value: float, unit: float) -> bool:
    ratio = value / unit
    return abs(ratio - round(ratio)) <= WHOLE * ratio


def _levels(scene: Scene) -> Iterator[tuple[str, Level]]:
    """Key and level of both ladders and of the sensitivity."""
    for solver in ("ancf", "reference"):
        yield from ((f"{solver}.levels.{i}", level) for i, level in enumerate(scene.ladder(solver)))
        level = getattr(scene.sensitivity, solver, None)
        if level is not None:
            yield f"sensitivity.{solver}", level


def _ladders(scene: Scene) -> Iterator[str]:
    if scene.ancf is None and scene.reference is None:
        yield "ancf, reference: both ladders are missing; state the levels of at least one solver"
    for solver in ("ancf", "reference"):
        seen = {}
        for i, level in enumerate(scene.ladder(solver)):
            first = seen.setdefault(level.model_copy(update={"budget": "full"}), i)
            if first != i:
                yield f"{solver}.levels.{i}: repeats {solver}.levels.{first}"


def _published(scene: Scene) -> Iterator[str]:
    if scene.published is not None:
        rows = [(f"published.rows.{i}.mesh", (row.mesh, row.points)) for i, row in enumerate(scene.published.rows)]
        yield from _repeated(rows, "this mesh and points already have a value in {first}")


def _companions(scene: Scene) -> Iterator[str]:
    for i, companion in enumerate(scene.companions):
        if companion not in names() and not companion.endswith(".toml"):
            yield f"companions.{i} = {companion!r}: no such scene; shipped are {', '.join(names())}"


def _sensitivity(scene: Scene) -> Iterator[str]:
    if scene.sensitivity is None:
        return
    if scene.sensitivity.ancf is None and scene.sensitivity.reference is None:
        yield "sensitivity: state the level of at least one solver, ancf or reference"
    named = ((f"sensitivity.variants.{i}.name", variant.name) for i, variant in enumerate(scene.sensitivity.variants))
    yield from _repeated(named, "this name is already taken by {first}")


def variant_problems(scene: Scene) -> Iterator[str]:
    """Problems of the scenes that the sensitivity's variants make of this one."""
    variants = () if scene.sensitivity is None else scene.sensitivity.variants
    for i, variant in enumerate(variants):
        try:
            scene.override(variant.set, f"sensitivity.variants.{i}.set")
        except SceneError as error:
            yield from error.problems


def _plain(value: object) -> str:
    return repr(list(value) if isinstance(value, tuple) else value)
