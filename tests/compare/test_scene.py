"""A scene is read as written, refused where it is wrong, and says the same physics in any spelling."""

import copy
import json
import tomllib
from types import SimpleNamespace

import pytest

from compare.scene import BUDGETS, SHIPPED, SceneError, load, names, parse

CANTILEVER = (SHIPPED / "cantilever.toml").read_text()
GROOVED = tomllib.loads(CANTILEVER)
CURVED = tomllib.loads((SHIPPED / "cylinder_panel.toml").read_text())
GONE = SimpleNamespace()
W = 0.5**0.5


def changed(changes, base=GROOVED):
    """Plain values of a shipped scene with dotted keys set otherwise or GONE; "end" appends to a list."""
    data = copy.deepcopy(base)
    for key, value in changes.items():
        *path, last = key.split(".")
        place = data
        for step in path:
            place = place[int(step)] if isinstance(place, list) else place[step]
        if value is GONE:
            del place[int(last) if isinstance(place, list) else last]
        elif last == "end":
            place.append(value)
        else:
            place[int(last) if isinstance(place, list) else last] = copy.deepcopy(value)
    return data


def refusals(changes, base=GROOVED):
    with pytest.raises(SceneError) as refused:
        parse(changed(changes, base), "my.toml")
    return refused.value.problems


def band(**more):
    return {"name": "new", "face": "bottom", "along": "x", "across": [0.4, 0.6], "depth": 0.01, **more}


def profile(points=((0.4, 0.0), (0.45, 0.02), (0.6, 0.0)), knots=(0, 0, 0, 1, 1, 1), **more):
    """A band with a curved section of degree 2."""
    curve = {"degree": 2, "control_points": [list(point) for point in points], "knots": list(knots), **more}
    return {"name": "new", "face": "bottom", "along": "x", "profile": curve}


def arched(depth):
    """A semicircle-like section whose greatest depth, at its middle, is `depth`: an ellipse from 0.4 to 0.6."""
    points = [(0.4, 0), (0.4, depth), (0.5, depth), (0.6, depth), (0.6, 0)]
    return profile(points, (0, 0, 0, 1, 1, 2, 2, 2), weights=[1, W, 1, W, 1])


PATH = {
    "analysis.kind": "static",
    "analysis.follow": "arc-length",
    "analysis.every": GONE,
    "reference": GONE,
}
KEYS = {
    "unknown key": ({"thikness": 0.05}, "thikness = 0.05: unknown key"),
    "unknown key below": ({"grooves.0.width": 0.1}, "grooves.0.width = 0.1: unknown key"),
    "missing key": ({"thickness": GONE}, "thickness: this key is missing"),
    "negative thickness": ({"thickness": -0.05}, "thickness = -0.05: must be greater than 0"),
    "number as text": ({"thickness": "0.05"}, "thickness = '0.05': needs a number"),
    "force as text": ({"loads.0.force": [0, 0, "-50"]}, "loads.0.force.2 = '-50': needs a number"),
    "number as truth": ({"thickness": True}, "thickness = True: needs a number"),
    "infinite": ({"thickness": float("inf")}, "thickness = inf: needs a finite number"),
    "not a number": ({"loads.0.force": [0.0, 0.0, float("nan")]}, "loads.0.force.2 = nan: needs a finite number"),
    "walls and layers": (
        {"ancf.levels.0.element": "enriched", "ancf.levels.0.walls": True, "ancf.levels.0.enrich": 0.9},
        "ancf.levels.0.walls = true: elements have wall functions or layers (enrich), not both",
    ),
    "contact without an obstacle": (
        {"ancf.levels.0.contact_points": [8, 4]},
        "ancf.levels.0.contact_points = [8, 4]: the scene has no obstacle; leave this out",
    ),
    "all of the gain": ({"ancf.levels.0.enrich": 1.0}, "ancf.levels.0.enrich = 1.0: must be less than 1"),
    "line on the edge": ({"ancf.levels.0.fit": [0.0]}, "ancf.levels.0.fit.0 = 0.0: must be greater than 0"),
    "fractional mesh": ({"ancf.levels.0.mesh": [2.5, 2]}, "ancf.levels.0.mesh.0 = 2.5: needs a whole number"),
    "kind of surface": (
        {"surface.kind": "disc"},
        "surface.kind = 'disc': must be one of 'rectangle', 'nurbs', 'revolved'",
    ),
    "no kind of load": ({"loads.0.kind": GONE}, "loads.0.kind: this key is missing"),
    "kind of load": (
        {"loads.0.kind": "wind"},
        "loads.0.kind = 'wind': must be one of 'point', 'edge', 'patch', 'gravity', 'pressure', 'moment'",
    ),
    "two numbers of three": ({"probes.0.at": [1.0, 1.0]}, "probes.0.at = [1.0, 1.0]: needs 3 numbers"),
    "three numbers of two": ({"grooves.0.across": [1, 2, 3]}, "grooves.0.across = [1, 2, 3]: needs 2 numbers"),
    "half a region": ({"probes.0": {"name": "P", "region": [[0, 1]]}}, "probes.0.region = [[0, 1]]: needs 2 intervals"),
    "face": ({"grooves.0.face": "side"}, "grooves.0.face = 'side': must be 'bottom' or 'top'"),
    "table expected": ({"material": 3}, "material = 3: needs a table of keys"),
    "list expected": ({"supports": 3}, "supports = 3: needs a list"),
    "default of a ladder": ({"ancf.pionts": 3}, "ancf.pionts = 3: unknown key"),
    "empty ladder": ({"ancf.levels": []}, "ancf.levels = []: needs at least one entry"),
    "no levels": ({"ancf": {"time_step": 0.01}}, "ancf.levels: this key is missing"),
    "no probes": ({"probes": []}, "probes = []: needs at least one entry"),
    "published without cell": ({"published.rows.0.cell": GONE}, "published.rows.0.cell: this key is missing"),
    "too few points": (
        {"ancf.levels.0.element": "enriched", "ancf.levels.0.points": [3, 3, 2]},
        "ancf.levels.0.points = [3, 3, 2]: the enriched element deforms without energy below [4, 4, 3]",
    ),
    "an indicator without a load": (
        {"loads": [], "ancf.levels.0.enrich": 0.9},
        "ancf.levels.0.enrich = 0.9: its indicator needs a load, and the scene states none",
    ),
    "too few points between free edges": (
        {"ancf.levels.0.element": "enriched", "ancf.levels.0.mesh": [4, 1], "ancf.levels.0.points": [4, 4, 3]},
        "ancf.levels.0.points = [4, 4, 3]: the enriched element deforms without energy below [4, 5, 3]",
    ),
    "schema of the future": ({"schema_version": 2}, "schema_version = 2: must be 1"),
}

STATIC = {"analysis.kind": "static", "grooves": []}
HOLD = {"kind": "hold", "edge": "x1", "components": ["Z"]}
MOMENT = {"kind": "moment", "edge": "x1", "moment": [0, 1, 0]}
ACTS = {
    "kind of support": (
        {"supports.0.kind": "glue"},
        "supports.0.kind = 'glue': must be one of 'clamp', 'hold', 'symmetry'",
    ),
    "hold of nothing": ({"supports.end": {**HOLD, "components": []}}, "supports.1.components = []: needs at least one"),
    "hold of a side": ({"supports.end": {**HOLD, "components": ["W"]}}, "supports.1.components.0 = 'W': must be"),
    "hold without a place": (
        {"supports.end": {"kind": "hold", "components": ["Z"]}},
        "supports.1.edge: this key is missing; a hold needs edge, corner, or whole = true",
    ),
    "hold of two places": (
        {"supports.end": {**HOLD, "corner": "x1y1"}},
        "supports.1.corner = 'x1y1': state one of edge, corner and whole",
    ),
    "hold of the middle of all": (
        {"supports.end": {"kind": "hold", "whole": True, "components": ["Z"], "over": "middle"}},
        "supports.1.over = 'middle': a plate held as a whole has no such part",
    ),
    "hold below a plate": (
        {"supports.end": {**HOLD, "over": "bottom"}},
        "supports.1.over = 'bottom': a plate holds its face or its middle",
    ),
    "hold of a clamp": (
        {"supports.end": {**HOLD, "edge": "x0"}},
        "supports.1.edge = 'x0': this edge is already clamped by supports.0.edge",
    ),
    "symmetry across": (
        {"supports.end": {"kind": "symmetry", "edge": "y1", "normal": "X"}},
        "supports.1.normal = 'X': the face of y1 lies in a plane of normal Y",
    ),
    "pressure in a groove": (
        {"loads.end": {"kind": "pressure", "face": "bottom", "pressure": 1.0}},
        "loads.1.face = 'bottom': grooves.0 lies on it; a pressure on a grooved face is not modelled",
    ),
    "moment in dynamics": ({"loads.end": MOMENT}, "loads.1.moment = [0.0, 1.0, 0.0]: a moment that follows its edge"),
    "moment about the director": (
        {**STATIC, "loads.end": {**MOMENT, "moment": [0, 0, 2]}},
        "loads.1.moment = [0.0, 0.0, 2.0]: its axis is the director of the edge",
    ),
    "no moment": (
        {**STATIC, "loads.end": {**MOMENT, "moment": [0, 0, 0]}},
        "loads.1.moment = [0.0, 0.0, 0.0]: a moment without a direction",
    ),
}

BANDS = {
    "as deep as the plate": ({"grooves.0.depth": 0.05}, "grooves.0.depth = 0.05: the groove is as deep as the plate"),
    "deeper than the plate": ({"grooves.0.depth": 0.06}, "grooves.0.depth = 0.06: the groove is as deep as the plate"),
    "profile as deep": ({"grooves.end": arched(0.05)}, "grooves.2.profile = 0.05 m deep: the groove is as deep"),
    "two faces together": (
        {"grooves.end": band(face="top", across=[0.25, 0.5], depth=0.02)},
        "grooves.2 overlaps grooves.0 ('left') on the other face: together 0.05 m deep",
    ),
    "two faces together, crossing": (
        {"grooves.end": band(face="top", along="y", depth=0.025)},
        "grooves.2 overlaps grooves.0 ('left') on the other face: together 0.055 m deep",
    ),
    "two faces together, curved": (
        {"grooves": [arched(0.03), {**arched(0.03), "name": "other", "face": "top"}]},
        "grooves.1 overlaps grooves.0 ('new') on the other face: together 0.06 m deep",
    ),
    "off the plate": (
        {"grooves.1.across": [0.95, 1.05]},
        "grooves.1.across = [0.95, 1.05]: off the plate, whose y runs",
    ),
    "far off the plate": ({"grooves.1.across": [2.0, 3.0]}, "grooves.1.across = [2.0, 3.0]: off the plate"),
    "extent off the plate": (
        {"grooves.0.extent": [0.5, 1.5]},
        "grooves.0.extent = [0.5, 1.5]: off the plate, whose x runs",
    ),
    "edges reversed": (
        {"grooves.0.across": [0.3, 0.2]},
        "grooves.0.across = [0.3, 0.2]: the first coordinate must be less",
    ),
    "extent empty": (
        {"grooves.0.extent": [0.3, 0.3]},
        "grooves.0.extent = [0.3, 0.3]: the first coordinate must be less",
    ),
    "no section": ({"grooves.0.depth": GONE, "grooves.0.across": GONE}, "grooves.0.across: this key is missing"),
    "no depth": ({"grooves.0.depth": GONE}, "grooves.0.depth: this key is missing; a band needs across and depth, or"),
    "both sections": (
        {"grooves.0.profile": profile()["profile"]},
        "grooves.0.profile: state either profile, or across and",
    ),
    "repeated name": (
        {"grooves.1.name": "left"},
        "grooves.1.name = 'left': this name is already taken by grooves.0.name",
    ),
    "name of a groove": (
        {"protrusions": [band(name="left")]},
        "protrusions.0.name = 'left': this name is already taken by",
    ),
    "curved over curved": (
        {"grooves": [arched(0.02), {**arched(0.02), "name": "b", "along": "y"}]},
        "grooves.1 overlaps grooves.0 ('new'): only rectangular sections may overlap on one face",
    ),
    "curved over rectangular": (
        {"grooves.end": {**arched(0.02), "along": "y"}},
        "grooves.2 overlaps grooves.0 ('left'): only rectangular sections may overlap on one face",
    ),
    "groove in protrusion": (
        {"protrusions": [band(across=[0.25, 0.4])]},
        "protrusions.0 overlaps grooves.0 ('left'): a groove",
    ),
}

CURVES = {
    "across decreasing": (
        {"grooves.end": profile([(0.4, 0), (0.7, 0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.2 = [0.6, 0.0]: the coordinate across must not decrease",
    ),
    "begins in the plate": (
        {"grooves.end": profile([(0.4, 0.01), (0.5, 0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.0 = [0.4, 0.01]: a profile begins and ends on the face",
    ),
    "negative depth": (
        {"grooves.end": profile([(0.4, 0), (0.5, -0.02), (0.6, 0)])},
        "grooves.2.profile.control_points.1 = [0.5, -0.02]: a depth must not be negative",
    ),
    "profile off the plate": (
        {"grooves.end": profile([(0.9, 0), (0.95, 0.02), (1.1, 0)])},
        "grooves.2.profile.control_points = [0.9, 1.1]: off the plate",
    ),
    "knots too few": (
        {"grooves.end": profile(knots=[0, 0, 1, 1])},
        "grooves.2.profile.knots = [0.0, 0.0, 1.0, 1.0]: 3 control points of degree 2 need 6 knots, not 4",
    ),
    "knots decreasing": ({"grooves.end": profile(knots=[0, 0, 0, 2, 1, 1])}, "knots must not decrease"),
    "knots not clamped": ({"grooves.end": profile(knots=[0, 0, 0.1, 1, 1, 1])}, "must each stand 3 times (degree + 1)"),
    "knots all equal": ({"grooves.end": profile(knots=[1] * 6)}, "the first and the last knot must differ"),
    "points too few": ({"grooves.end": profile([(0.4, 0), (0.6, 0)])}, "degree 2 needs at least 3 control points"),
    "torn curve": (
        {"grooves.end": profile([(0.4, 0), *[(0.5, 0.01)] * 4, (0.6, 0)], [0, 0, 0, 1, 1, 1, 2, 2, 2])},
        "an inner knot may stand 2 times at most (degree)",
    ),
    "weights too few": ({"grooves.end": profile(weights=[1, 1])}, "3 control points need as many weights"),
    "weight of zero": (
        {"grooves.end": profile(weights=[1, 0, 1])},
        "grooves.2.profile.weights.1 = 0: must be greater than 0",
    ),
}

RUBBER = {"kind": "mooney-rivlin", "mu10": 0.8e6, "mu01": 0.2e6, "bulk_modulus": 3e7, "density": 1100.0}
RUBBERS = {
    "no such material": ({"material.kind": "ogden"}, "material.kind = 'ogden': must be one of 'svk', 'mooney-rivlin'"),
    "constants of another material": (
        {"material": {**RUBBER, "youngs_modulus": 2e6}},
        "material.youngs_modulus = 2000000.0: unknown key",
    ),
    "no bulk modulus": (
        {"material": RUBBER, "material.bulk_modulus": GONE},
        "material.bulk_modulus: this key is missing",
    ),
    "no shear": ({"material": {**RUBBER, "mu10": 0.0}}, "material.mu10 = 0.0: must be greater than 0"),
    "negative second constant": (
        {"material": {**RUBBER, "mu01": -1.0}},
        "material.mu01 = -1.0: must be greater than or equal to 0",
    ),
    "no mass": (
        {"material": RUBBER, "material.density": GONE},
        "material.density: this key is missing; dynamics cannot do without mass",
    ),
    "no quadratic form": (
        {"material": RUBBER, "ancf.levels.0.integrator": "energy-momentum"},
        "ancf.levels.0.integrator = 'energy-momentum': keeps the energy of an svk solid alone",
    ),
    "layers": ({"material": RUBBER, "ancf.levels.0.enrich": 0.9}, "ancf.levels.0.enrich = 0.9: its indicator is that"),
    "energy of a load that follows": (
        {
            "loads.0": {"kind": "pressure", "face": "top", "pressure": 3.0, "follower": True},
            "ancf.levels.0.integrator": "energy-momentum",
        },
        "ancf.levels.0.integrator = 'energy-momentum': with loads.0.follower it takes dead loads only",
    ),
    "volume of a material without a choice": (
        {"ancf.levels.0.volumetric": "reduced"},
        "ancf.levels.0.volumetric = 'reduced': for material.kind = 'mooney-rivlin' alone",
    ),
}

REST = {
    "incompressible": (
        {"material.poissons_ratio": 0.5},
        "material.poissons_ratio = 0.5: an incompressible St. Venant-Kirchhoff",
    ),
    "beyond incompressible": (
        {"material.poissons_ratio": 0.6},
        "material.poissons_ratio = 0.6: no stable elastic solid",
    ),
    "minus one": ({"material.poissons_ratio": -1.0}, "material.poissons_ratio = -1: no stable elastic solid"),
    "dynamics without mass": (
        {"material.density": GONE},
        "material.density: this key is missing; dynamics cannot do without mass",
    ),
    "gravity without mass": (
        {
            "material.density": GONE,
            "analysis.kind": "static",
            "loads.0": {"kind": "gravity", "acceleration": [0, 0, -9.81]},
        },
        "material.density: this key is missing; gravity cannot do without mass",
    ),
    "statics unsupported": (
        {"analysis.kind": "static", "supports": []},
        "supports = []: statics without a support is singular",
    ),
    "clamped twice": (
        {"supports.end": {"kind": "clamp", "edge": "x0"}},
        "supports.1.edge = 'x0': this edge is already clamped",
    ),
    "velocity in statics": (
        {"analysis.kind": "static", "initial": {"velocity": [0, 0, 1]}},
        "initial: statics has no velocity",
    ),
    "load outside": ({"loads.0.at": [1.0, 1.5]}, "loads.0.at = [1.0, 1.5]: off the plate, whose y runs from 0 to 1"),
    "probe outside": ({"probes.0.at": [-0.1, 1.0, 0.0]}, "probes.0.at = [-0.1, 1.0, 0.0]: off the plate, whose x runs"),
    "probe above": (
        {"probes.0.at": [1.0, 1.0, 0.03]},
        "probes.0.at = [1.0, 1.0, 0.03]: outside the material, whose z runs from -0.025 to 0.025",
    ),
    "probe in a groove": (
        {"probes.0.at": [1.0, 0.25, 0.0]},
        "probes.0.at = [1.0, 0.25, 0.0]: outside the material, whose z runs from 0.005",
    ),
    "probe in a curved groove": (
        {"grooves.end": arched(0.03), "probes.0.at": [1.0, 0.42, -0.01]},
        "outside the material, whose z runs from -0.007 to 0.025",  # depth 0.03 * 0.6 at 0.8 of the half width
    ),
    "region reversed": (
        {"probes.0": {"name": "P", "region": [[1, 0.9], [0, 1]]}},
        "probes.0.region.0 = [1, 0.9]: the first",
    ),
    "region empty": ({"probes.0": {"name": "P", "region": [[0, 1], [1, 1]]}}, "probes.0.region.1 = [1, 1]: the first"),
    "region outside": (
        {"probes.0": {"name": "P", "region": [[0, 1], [1, 2]]}},
        "probes.0.region.1 = [1, 2]: off the plate",
    ),
    "load's region outside": (
        {"loads.0": {"kind": "patch", "region": [[-1, 0], [0, 1]], "force": [0, 0, 1]}},
        "loads.0.region.0 = [-1, 0]: off the plate, whose x runs from 0 to 1",
    ),
    "probes of one name": (
        {"probes.end": {"name": "P", "at": [0, 0, 0]}},
        "probes.1.name = 'P': this name is already taken",
    ),
    "history not increasing": (
        {"loads.0.history": [[0, 0], [1, 1], [1, 2]]},
        "loads.0.history.2 = [1.0, 2.0]: its time must be later than 1",
    ),
    "history empty": ({"loads.0.history": []}, "loads.0.history = []: needs at least one pair"),
    "until": ({"analysis.every": 0.3}, "analysis.until = 1: not a whole multiple of analysis.every = 0.3"),
    "until before every": ({"analysis.every": 2.0}, "analysis.until = 1: not a whole multiple of analysis.every = 2"),
    "time step": (
        {"ancf.levels.2.time_step": 0.003},
        "ancf.levels.2.time_step = 0.003: analysis.every = 0.02 is not a whole multiple",
    ),
    "time step of the reference": (
        {"reference.time_step": 0.04},
        "reference.levels.0.time_step = 0.04: analysis.every = 0.02",
    ),
    "largest step of the reference": (
        {"reference.time_step": 0.04, "reference.error_per_step": 1e-5},
        "reference.levels.0.time_step = 0.04: analysis.every = 0.02",
    ),
    "allowed error in statics": (
        {"analysis.kind": "static", "reference.error_per_step": 1e-5},
        "reference.levels.0.error_per_step = 1e-05: statics adds no error per step",
    ),
    "no allowed error": ({"reference.error_per_step": 0.0}, "reference.error_per_step = 0.0: must be greater than 0"),
    "time step of the sensitivity": (
        {"sensitivity.ancf.time_step": 0.015},
        "sensitivity.ancf.time_step = 0.015: analysis.every",
    ),
    "path in time": ({**PATH, "analysis.kind": "dynamic"}, "analysis.follow = 'arc-length': dynamics follows time"),
    "path without a growing load": (
        {**PATH, "loads.0.history": [[0.0, 1.0]]},
        "analysis.follow = 'arc-length': no load grows with the load parameter",
    ),
    "path of the reference": (
        {**PATH, "reference": {"levels": [{"size": 0.1, "time_step": 0.1}]}},
        "analysis.follow = 'arc-length': the reference follows the load alone",
    ),
    "moment of a path": (
        {**PATH, "loads.end": {"kind": "moment", "edge": "x1", "moment": [0, 1, 0]}},
        "loads.1.kind = 'moment': an arc length follows dead loads only",
    ),
    "outputs of a path": ({**PATH, "analysis.every": 0.5}, "analysis.every = 0.5: along an arc length every step is"),
    "bent history of a path": (
        {**PATH, "loads.0.history": [[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]]},
        "loads.0.history.1 = [0.5, 1.0]: along an arc length a load is constant",
    ),
    "no ladder": ({"ancf": GONE, "reference": GONE}, "ancf, reference: both ladders are missing"),
    "repeated level": ({"ancf.levels.end": {"mesh": [2, 2]}}, "ancf.levels.8: repeats ancf.levels.0"),
    "repeated row": (
        {"published.rows.end": {"mesh": [2, 2], "value": 0, "cell": "again"}},
        "published.rows.8.mesh = [(2, 2), None]: this mesh and points already have a value in published.rows.0.mesh",
    ),
    "unknown companion": ({"companions.0": "cantilevre"}, "companions.0 = 'cantilevre': no such scene; shipped are"),
    "variant of no key": (
        {"sensitivity.variants.0.set": {"groves.0.depth": 0.02}},
        "sensitivity.variants.0.set: groves.0.depth = 0.02: the scene has no such key",
    ),
    "variant of a wrong key": (
        {"sensitivity.variants.0.set": {"grooves.0.dept": 1}},
        "grooves.0.dept = 1: unknown key",
    ),
    "variant of no groove": ({"sensitivity.variants.0.set": {"grooves.2.depth": 1}}, "the scene has no such key"),
    "variant too deep": (
        {"sensitivity.variants.0.set": {"grooves.0.depth": 0.05}},
        "sensitivity.variants.0.set: grooves.0.depth = 0.05: the groove is as deep",
    ),
    "variants of one name": (
        {"sensitivity.variants.1.name": "width 0.09 m"},
        "sensitivity.variants.1.name = 'width 0.09 m': this name is already taken",
    ),
    "variants without a level": ({"sensitivity.ancf": GONE}, "sensitivity: state the level of at least one solver"),
}

SURFACES = {
    "knots too many": (
        {"surface.knots.0": [0, 0, 0.2, 0.5, 0.5]},
        "surface.knots.0 = [0.0, 0.0, 0.2, 0.5, 0.5]: 2 control points",
    ),
    "no knots": ({"surface.knots.1": []}, "surface.knots.1 = []: 3 control points of degree 2 need 6 knots, not 0"),
    "knots not clamped": (
        {"surface.knots.1": [0, 0, 0.5, 1, 1, 1]},
        "surface.knots.1 = [0.0, 0.0, 0.5, 1.0, 1.0, 1.0]: the first",
    ),
    "ragged net": (
        {"surface.control_points.0.0": GONE},
        "surface.control_points = rows of [2, 3] points: each row needs",
    ),
    "empty net": ({"surface.control_points": []}, "surface.control_points = rows of [] points"),
    "flat point": (
        {"surface.control_points.0.0": [0.0, 0.0]},
        "surface.control_points.0.0 = [0.0, 0.0]: needs 3 numbers",
    ),
    "weights of another shape": (
        {"surface.weights.0": [1, 1]},
        "surface.weights = rows of [2, 3] weights: the net of control points is 2 x 3",
    ),
    "symmetry of an arc across its chord": (
        {"supports.end": {"kind": "symmetry", "edge": "x1", "normal": "Z"}},
        "supports.1.normal = 'Z': the edge x1 does not lie in a plane of this normal",
    ),
    "symmetry of an edge whose directors lean": (
        {"supports.end": {"kind": "symmetry", "edge": "y1", "normal": "Y"}},
        "supports.1.normal = 'Y': the directors of the edge y1 lean out of the plane",
    ),
    "off the patch": (
        {"grooves.0.across": [0.4, 1.6]},
        "grooves.0.across = [0.4, 1.6]: off the plate, whose y runs from 0 to 1",
    ),
}


@pytest.mark.parametrize(
    "changes, expected",
    [pytest.param(*case, id=name) for name, case in (KEYS | ACTS | BANDS | CURVES | REST | RUBBERS).items()],
)
def test_a_wrong_scene_is_refused(changes, expected):
    """One line for one mistake: file, key, value, reason."""
    found = refusals(changes)
    assert any(expected in problem for problem in found), found
    assert all(problem.startswith("my.toml: ") for problem in found)
    assert len(found) <= 2, found


@pytest.mark.parametrize("changes, expected", [pytest.param(*case, id=name) for name, case in SURFACES.items()])
def test_a_wrong_surface_is_refused(changes, expected):
    found = refusals(changes, CURVED)
    assert len(found) == 1 and expected in found[0], found


def test_all_problems_are_told_at_once():
    keys = refusals({"thickness": -1, "grooves.0.depth": "deep", "probes.0.at": [1, 1]})
    assert len(keys) == 3
    meaning = refusals(
        {"grooves.0.depth": 0.05, "grooves.1.across": [0.9, 1.1], "material.poissons_ratio": 0.5, "analysis.every": 0.3}
    )
    assert {line.split()[1] for line in meaning} >= {
        "grooves.0.depth",
        "grooves.1.across",
        "material.poissons_ratio",
        "analysis.until",
    }


ALLOWED = {
    "grooves that cross": {"grooves.end": band(along="y")},
    "grooves that touch": {"grooves.end": band(across=[0.3, 0.5])},
    "groove to the plate's edge": {"grooves.end": band(across=[0.9, 1.0])},
    "groove over the whole plate": {"grooves": [band(across=[0.0, 1.0])]},
    "grooves one above the other": {"grooves.end": band(face="top", across=[0.2, 0.3], depth=0.019)},
    "curved groove beside": {"grooves.end": arched(0.04)},
    "protrusion above a groove": {"protrusions": [band(face="top", across=[0.2, 0.3], depth=0.2)]},
    "probe on a groove's floor": {"probes.0.at": [1.0, 0.25, 0.005]},
    "probe on a groove's wall": {"probes.0.at": [1.0, 0.2, -0.02]},
    "short grooves that do not meet": {
        "grooves.0.extent": [0.0, 0.5],
        "grooves.end": band(face="top", across=[0.2, 0.3], depth=0.04, extent=[0.5, 0.9]),
    },
    "probe beyond a groove's end": {"grooves.0.extent": [0.0, 0.5], "probes.0.at": [0.6, 0.25, -0.025]},
    "probe on a protrusion": {"protrusions": [band()], "probes.0.at": [1.0, 0.5, -0.035]},
    "region partly outside": {"probes.0": {"name": "P", "region": [[0.9, 1.1], [0.9, 1.1]]}},
    "nearly incompressible": {"material.poissons_ratio": 0.499},
    "hold over a plane of symmetry": {
        "supports.end": {"kind": "symmetry", "edge": "y0", "normal": "Y"},
        "loads.end": {"kind": "pressure", "face": "top", "pressure": -3.0},
    },
    "corner held": {"supports.end": {"kind": "hold", "corner": "x1y1", "components": ["X", "Z"], "over": "middle"}},
    "bottom of a solid held": {
        "supports.end": {"kind": "hold", "edge": "y0", "components": ["Z"], "over": "bottom"},
        "ancf": GONE,
    },
    "moment in statics": {"analysis.kind": "static", "loads.end": MOMENT},
    "auxetic": {"material.poissons_ratio": -0.9},
    "statics without mass": {"material.density": GONE, "analysis.kind": "static"},
    "free flight": {"supports": [], "initial": {"velocity": [1, 0, 0]}},
    "one solver": {"reference": GONE},
    "three tenths": {"analysis.until": 0.3, "analysis.every": 0.1},
}


@pytest.mark.parametrize("changes", [pytest.param(case, id=name) for name, case in ALLOWED.items()])
def test_an_unusual_scene_is_allowed(changes):
    parse(changed(changes | {"sensitivity": GONE}), "my.toml")


def test_an_arc_lies_in_the_plane_of_its_ends():
    parse(changed({"supports.end": {"kind": "symmetry", "edge": "x1", "normal": "X"}}, CURVED), "my.toml")


def test_opposite_curved_grooves_may_be_deep_at_different_places():
    """Two ellipses of 0.03 m whose edges cross: only where they overlap their depths add up."""
    beside = [
        [y + 0.15 if i == 0 else y for i, y in enumerate(point)] for point in arched(0.03)["profile"]["control_points"]
    ]
    other = {**arched(0.03), "name": "other", "face": "top"}
    other["profile"] = {**other["profile"], "control_points": beside}
    parse(changed({"grooves": [arched(0.03), other], "sensitivity": GONE}), "my.toml")


@pytest.mark.parametrize("name", names())
def test_shipped_scenes_load_and_state_their_source(name):
    scene = load(name)
    assert scene.name == name and scene.source and scene.assumed


@pytest.mark.parametrize("name", names())
def test_reading_what_was_written_gives_the_same_scene(name):
    scene = load(name)
    for written in (scene.model_dump(mode="json"), scene.model_dump(mode="json", exclude_defaults=True)):
        assert parse(json.loads(json.dumps(written)), name) == scene


@pytest.mark.parametrize("name", names())
def test_budgets_nest(name):
    scene = load(name)
    for solver in ("ancf", "reference") if scene.reference else ("ancf",):
        ladders = [scene.ladder(solver, budget) for budget in BUDGETS]
        assert ladders[0] and set(ladders[0]) <= set(ladders[1]) <= set(ladders[2]) == set(scene.ladder(solver))


def test_published_table_is_complete():
    plain, grooved = load("cantilever_plain").published, load("cantilever").published
    assert [row.mesh[0] for row in plain.rows] == [row.mesh[0] for row in grooved.rows] == [2, 3, 4, 5, 6, 8, 12, 16]
    assert (plain.converged.value, grooved.converged.value) == (-0.5022, -0.5669)
    levels = {(level.mesh, level.points) for level in load("cantilever_plain").ladder("ancf")}
    assert all((row.mesh, row.points) in levels for row in plain.rows if row.points)


def test_a_file_of_the_user_is_read_by_its_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CANTILEVER.replace("depth = 0.03\n", "depth = 0.02\n"))
    assert [groove.depth for groove in load(path).grooves] == [0.02, 0.02]
    path.write_text(CANTILEVER.replace("depth = 0.03\n", "depth = -0.03\n", 1))
    with pytest.raises(SceneError, match=r"mine\.toml: grooves\.0\.depth = -0\.03: must be greater than 0"):
        load(path)
    path.write_text("thickness = ")
    with pytest.raises(SceneError, match=r"mine\.toml: not a TOML file"):
        load(path)
    with pytest.raises(SceneError, match="no such scene"):
        load(tmp_path / "other.toml")


def test_override_changes_only_what_it_names():
    scene = load("cantilever")
    deeper = scene.override({"grooves.0.depth": 0.02, "surface.length": 2}, "deeper")
    assert deeper.grooves[0].depth == 0.02 and deeper.surface.length == 2 and deeper.name == "deeper"
    back = deeper.override({"grooves.0.depth": 0.03, "surface.length": 1.0}, "cantilever")
    assert back == scene


def test_override_replaces_a_whole_table_and_removes_a_key():
    scene = load("cantilever")
    variant = {variant.name: variant for variant in scene.sensitivity.variants}[
        "walls rounded to quarter circles of 0.03 m"
    ]
    rounded = scene.override(variant.set)
    assert all(groove.profile is not None and groove.depth is None for groove in rounded.grooves)
    assert [groove.edges for groove in rounded.grooves] == [(0.2, 0.3), (0.7, 0.8)]
    assert scene.override({"reference": None}).reference is None


def test_override_of_a_ladder_reaches_every_level():
    scene = load("cantilever").override({"ancf.time_step": 0.02, "ancf.points": [2, 2, 2]})
    assert {(level.time_step, level.points) for level in scene.ladder("ancf")} == {(0.02, (2, 2, 2))}


@pytest.mark.parametrize("key", ["groove.0.depth", "grooves.5.depth", "grooves.left.depth", "thickness.a", "thikness"])
def test_override_of_a_missing_key_is_refused(key):
    with pytest.raises(SceneError, match=key.split(".")[0]):
        load("cantilever").override({key: 0.02})


def test_variants_differ_in_physics():
    scene = load("cantilever")
    spelled = {json.dumps(scene.override(v.set).physics(), sort_keys=True) for v in scene.sensitivity.variants}
    assert len(spelled | {json.dumps(scene.physics(), sort_keys=True)}) == len(scene.sensitivity.variants) + 1


def test_physics_does_not_depend_on_the_spelling():
    """Order of keys, 1 or 1.0, stated defaults, another title or ladder: the same JSON, byte for byte."""
    other = {key: copy.deepcopy(GROOVED[key]) for key in reversed(GROOVED)}
    other |= {"title": "another", "assumed": [], "schema_version": 1, "protrusions": []}
    other["surface"] = {"width": 1, "length": 1, "kind": "rectangle"}
    other["material"] |= {"youngs_modulus": 2_000_000, "poissons_ratio": -0.0}
    other["loads"][0] |= {"at": [1, 1], "force": [-0.0, 0, -50]}
    other["probes"][0] = {"at": [1, 1, 0], "name": "P"}
    other["ancf"]["levels"] = [{"mesh": [2, 2], "time_step": 0.01}]
    other["published"] = {"source": "another"}
    del other["sensitivity"], other["reference"]
    assert json.dumps(parse(other, "other").physics()) == json.dumps(load("cantilever").physics())


@pytest.mark.parametrize(
    "changes",
    [{"grooves.0.depth": 0.031}, {"analysis.every": 0.1}, {"supports.0.gradients": "tangential"}, {"thickness": 0.06}],
)
def test_physics_tells_different_scenes_apart(changes):
    scene = load("cantilever")
    assert scene.override(changes).physics() != scene.physics()


def test_elements_and_their_least_points_are_those_of_the_solver():
    """compare imports no solver, so it states both again."""
    from typing import get_args

    from ancf.shape import FAMILY
    from compare.scene import AncfLevel
    from compare.scene_checks import LEAST_POINTS

    assert set(get_args(AncfLevel.model_fields["element"].annotation)) == set(FAMILY)
    least = {name: shape.least_points for name, shape in FAMILY.items() if shape.least_points != (1, 1, 1)}
    assert least == LEAST_POINTS
