"""A wrong scene is refused with file, key, value and reason: keys, what acts, materials, levels."""

import pytest

from tests.compare.scene_changes import GONE, HOLD, MOMENT, PATH, RUBBER, STATIC, arched, refusals

HINGE = {"kind": "hold", "edge": "x0", "components": ["X", "Y", "Z"], "over": "middle"}
ONE_ACROSS = {"ancf.levels.0.element": "enriched", "ancf.levels.0.mesh": [1, 4], "ancf.levels.0.points": [4, 4, 3]}
GROUND = {"name": "ground", "shape": {"kind": "plane"}, "stiffness": 1e6}
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
    "lips without walls": (
        {"ancf.levels.0.lips": True},
        "ancf.levels.0.lips = true: what ends at walls needs them; state walls = true as well, or leave this out",
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
    "name of the index": ({"name": "index"}, "name = 'index': a page or an accepted table that is no scene's has this"),
    "name of a study": ({"name": "tire"}, "name = 'tire': a page or an accepted table that is no scene's has this"),
    "too few points between a hinge and a free edge": (
        {"supports": [{"kind": "clamp", "edge": "y0"}, HINGE], **ONE_ACROSS},
        "ancf.levels.0.points = [4, 4, 3]: the enriched element deforms without energy below [5, 4, 3]",
    ),
    "too few points where fit adds no line": (
        {"supports.0.edge": "y0", **ONE_ACROSS, "ancf.levels.0.fit": [0.5]},
        "ancf.levels.0.points = [4, 4, 3]: the enriched element deforms without energy below [5, 4, 3]",
    ),
    "too few points where a line would stand on the edge": (
        {"supports.0.edge": "y0", **ONE_ACROSS, "ancf.levels.0.fit": [0.5], "grooves.0.extent": [4e-4, 1.0]},
        "ancf.levels.0.points = [4, 4, 3]: the enriched element deforms without energy below [5, 4, 3]",
    ),
    "no points left of few": (
        {"material": RUBBER, "ancf.levels.0.points": [3, 3, 1], "ancf.levels.0.volumetric": "reduced"},
        "ancf.levels.0.points = [3, 3, 1]: volumetric = 'reduced' takes one point fewer each way",
    ),
    "schema of the future": ({"schema_version": 2}, "schema_version = 2: must be 1"),
}
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
    "integrator in statics": (
        {"analysis.kind": "static", "ancf.levels.0.integrator": "energy-momentum"},
        "ancf.levels.0.integrator = 'energy-momentum': statics has no motion to integrate",
    ),
    "integrator of the reference in statics": (
        {"analysis.kind": "static", "reference.integrator": "generalized-alpha"},
        "reference.levels.0.integrator = 'generalized-alpha': statics has no motion to integrate",
    ),
    "integrator of a path": (
        {**PATH, "loads.0.history": [[0, 0], [1, 1]], "ancf.levels.0.integrator": "energy-momentum"},
        "ancf.levels.0.integrator = 'energy-momentum': statics has no motion to integrate",
    ),
    "damping in statics": (
        {"analysis.kind": "static", "obstacles": [{**GROUND, "damping": 2.0}]},
        "obstacles.0.damping = 2: statics has no velocity",
    ),
    "damping of stick in statics": (
        {"analysis.kind": "static", "obstacles": [{**GROUND, "friction": 0.5, "stick_damping": 2.0}]},
        "obstacles.0.stick_damping = 2: statics has no velocity",
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


@pytest.mark.parametrize(
    "changes, expected",
    [pytest.param(*case, id=name) for name, case in (KEYS | ACTS | RUBBERS | REST).items()],
)
def test_a_wrong_scene_is_refused(changes, expected):
    """One line for one mistake: file, key, value, reason."""
    found = refusals(changes)
    assert any(expected in problem for problem in found), found
    assert all(problem.startswith("my.toml: ") for problem in found)
    assert len(found) <= 2, found


def test_an_edge_clamped_twice_is_told_once_among_any_number_of_clamps():
    clamps = [{"kind": "clamp", "edge": edge} for edge in ("x0", "x0", "y0", "y1")]
    assert refusals({"supports": clamps}) == [
        "my.toml: supports.1.edge = 'x0': this edge is already clamped by supports.0.edge"
    ]


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
