"""Scenes that ask for modes, from the file to the page: refusals, rows, limits, gate, pictures; no solver."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from compare import gate, result
from compare.difference import DifferenceRefused, between
from compare.explain import statement
from compare.formats import as_terminal
from compare.progress import line
from compare.result import Outline, Result, ResultError
from compare.scene import SceneError, load, parse
from compare.study import Entry, level_name
from compare.table import KEYS, answer, in_ladders, judgements, quantity, rows, unit
from reports import scene as page
from reports import sections
from reports.ladders import convergence, ladders, limit_errors

SCENE = load("plate_modes").override(
    {
        "analysis.count": 2,
        "ancf": {"levels": [{"mesh": [n, n], "element": "enriched", "budget": "quick"} for n in (2, 4, 8)]},
        "reference": {"levels": [{"size": h, "budget": "quick"} for h in (0.4, 0.2, 0.1)]},
    }
)
PLAIN = load("plate_modes").model_dump(mode="json", exclude_defaults=True)
LIMITS = {"ancf": (17.0, 42.0), "reference": (17.1, 42.5)}


def entry(solver, level, status="ok"):
    """An entry whose mode k has the frequency limit_k (1 + k h²)."""
    h = 1 / level.mesh[0] if solver == "ancf" else level.size
    found = np.array([limit * (1 + mode * h**2) for mode, limit in enumerate(LIMITS[solver], 1)])
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    shapes = np.zeros((2, 4, 3))
    shapes[:, 1:3, 2] = [[1.0, 1.0], [1.0, -1.0]]
    outline = Outline(points, 0 * points, np.array([[0, 1, 2], [0, 2, 3]]), np.empty((0, 2), int), shapes)
    made = Result(
        scene=SCENE.physics(), solver=solver, version="0", level=level.model_dump(mode="json"), h=h, unknowns=9,
        times=np.empty(0), probes=(), probe_position=np.empty((0, 3)), displacement=np.empty((0, 0, 3)), energies={},
        status=status, facts={"rigid_modes": 0}, outline=outline, frequencies=found if status == "ok" else np.empty(0),
    )  # fmt: skip
    return Entry(SCENE, None, solver, level, made, status, "", 0.1, 3, True, f"{solver}{h}")


ENTRIES = [entry(solver, level) for solver in ("ancf", "reference") for level in SCENE.ladder(solver)]

REFUSED = {
    "time": ({"analysis": {"kind": "modes", "count": 3, "until": 1.0}}, "analysis.until = 1.0: modes have no time"),
    "output times": ({"analysis": {"kind": "modes", "count": 3, "every": 0.1}}, "analysis.every = 0.1: modes have no"),
    "no count": ({"analysis": {"kind": "modes"}}, "analysis.count: this key is missing"),
    "no modes": ({"analysis": {"kind": "modes", "count": 0}}, "analysis.count = 0: must be greater than 0"),
    "half a mode": ({"analysis": {"kind": "modes", "count": 1.5}}, "analysis.count = 1.5: needs a whole number"),
    "loads": ({"loads": [{"kind": "gravity", "acceleration": [0, 0, -9.81]}]}, "loads: modes are small vibrations"),
    "velocity": ({"initial": {"velocity": [1, 0, 0]}}, "initial: modes are found without a motion"),
    "probes": ({"probes": [{"name": "P", "at": [1, 1, 0]}]}, "probes: modes are told by their frequencies"),
    "published": (
        {"published": {"source": "a book"}},
        "published: modes are told by their frequencies, published values",
    ),
    "no mass": (
        {"material": {"kind": "svk", "youngs_modulus": 1e9}},
        "material.density: this key is missing; vibration",
    ),
    "time step": (
        {"ancf": {"levels": [{"mesh": [2, 2], "time_step": 0.1}]}},
        "ancf.levels.0.time_step = 0.1: modes take",
    ),
    "integrator": (
        {"reference": {"levels": [{"size": 0.5, "integrator": "generalized-alpha"}]}},
        "reference.levels.0.integrator = 'generalized-alpha': modes take no steps",
    ),
    "count of a motion": ({"analysis": {"kind": "static", "count": 3}}, "analysis.count = 3: unknown key"),
    "step of a motion": (
        {"analysis": {"kind": "static"}, "probes": [{"name": "P", "at": [1, 1, 0]}]},
        "ancf.levels.0.time_step: this key is missing",
    ),
}


@pytest.mark.parametrize("changes, expected", REFUSED.values(), ids=REFUSED)
def test_what_modes_cannot_have_is_refused(changes, expected):
    with pytest.raises(SceneError) as refused:
        parse(PLAIN | changes, "my.toml")
    assert any(problem.startswith(f"my.toml: {expected}") for problem in refused.value.problems), refused.value.problems


def test_the_answer_is_the_first_frequency():
    assert (unit(SCENE), quantity(SCENE), quantity(SCENE, 2)) == ("Hz", "frequency of mode 1", "frequency of mode 2")
    assert answer(ENTRIES[0]) == pytest.approx(17.0 * 1.25)
    assert "21.25000 Hz" in line(ENTRIES[0])
    words = dict(statement(SCENE))
    assert words["answer"] == "the 2 lowest natural frequencies in Hz, rigid motions not counted"
    assert "undeformed" in words["analysis"]


def test_every_mode_of_every_level_is_a_row():
    found = rows(ENTRIES)
    assert [tuple(row) for row in found] == [KEYS] * 12
    assert [row["mode"] for row in found] == [1] * 6 + [2] * 6
    assert [row["mesh"] for row in found[:6]] == [level_name(e.level) for e in ENTRIES]
    assert [row["value"] for row in found[:3]] == pytest.approx([17.0 * (1 + h**2) for h in (0.5, 0.25, 0.125)])
    assert in_ladders(in_ladders(ENTRIES)) == in_ladders(ENTRIES)


def test_each_mode_has_its_own_order_limit_and_reference():
    found = rows(ENTRIES)
    for mode, row in ((1, found[2]), (2, found[8])):
        assert row["order"] == pytest.approx(2.0)
        assert row["extrapolated"] == pytest.approx(LIMITS["ancf"][mode - 1])
        against = LIMITS["reference"][mode - 1] * (1 + mode * 0.01)
        assert row["error_reference_percent"] == pytest.approx(100 * (row["value"] / against - 1))
    assert len(judgements(ENTRIES)) == len(limit_errors(ENTRIES)) == 12
    assert limit_errors(ENTRIES)[8] == pytest.approx(100 * 2 * 0.125**2)
    told = convergence(ENTRIES)
    assert [(row["mode"], row["unit"]) for row in told] == [(1, "Hz"), (1, "Hz"), (2, "Hz"), (2, "Hz")]
    assert [ladder.role for ladder in ladders(ENTRIES, SCENE.name)] == ["ancf", "reference"] * 2


def test_a_failed_level_is_a_row_per_mode_without_a_number():
    found = rows([entry("ancf", SCENE.ancf.levels[0], "modes_not_converged"), *ENTRIES[1:3]])
    assert [(row["value"], row["status"]) for row in found[::3]] == [(None, "modes_not_converged")] * 2
    assert [row["gci_percent"] for row in found] == [None] * 6


def test_terminal_tables_are_in_hertz():
    console = Console(width=200, file=io.StringIO())
    for drawn in as_terminal(rows(ENTRIES)):
        console.print(drawn)
    text = console.file.getvalue()
    assert "ancf (enriched), groove: none, modes" in text and "frequency Hz" in text and "height" not in text


def test_the_gate_knows_modes_apart(tmp_path):
    baseline = gate.accept(rows(ENTRIES), "first", "plate", tmp_path / "plate.json")
    found = gate.check(rows(ENTRIES), baseline)
    assert found.passed and len({margin.row for margin in found.margins}) == 12
    moved = rows(
        [*ENTRIES[:2], replace(ENTRIES[2], result=replace(ENTRIES[2].result, frequencies=np.array([17.0, 42.0])))]
    )
    refused = [margin.row for margin in gate.check(moved, baseline).margins if margin.verdict == "moved"]
    assert refused == [
        f"solver ancf, element enriched, rule 7x7x3, groove none, load none, mode {m}, mesh 8x8" for m in (1, 2)
    ]
    assert " Hz, accepted " in gate.lines(found)[0]


def test_a_baseline_from_before_modes_is_still_read():
    old = {"solver": "ancf", "element": "conforming", "rule": None, "groove": "none", "load": "point", "mesh": "2x2"}
    assert list(gate.named([{**old, "value": 1.0}])) == list(gate.named([{**old, "mode": None, "value": 1.0}]))


def test_modes_have_no_heights_to_compare():
    with pytest.raises(DifferenceRefused, match="no probe"):
        between(ENTRIES[0].result, ENTRIES[3].result)


def test_a_result_of_the_first_schema_is_read_and_one_of_the_future_refused(tmp_path, monkeypatch):
    path = tmp_path / "r.npz"
    for schema, readable in ((1, True), (99, False)):
        monkeypatch.setattr(result, "SCHEMA", schema)
        result.save(replace(ENTRIES[0].result, frequencies=None, outline=None), path)
        if readable:
            assert result.load(path).frequencies is None
        else:
            with pytest.raises(ResultError, match="schema 99, this version reads 1"):
                result.load(path)


def test_the_page_shows_every_frequency_and_draws_every_mode(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(sections.figures, "render", lambda jobs: (drawn.extend(jobs), ([], "not drawn"))[1])
    path = page.publish(SCENE, ENTRIES, rows(ENTRIES), tmp_path)
    text, content = path.read_text(encoding="utf-8"), json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    for row in content["rows"]:
        assert f'<data value="{json.dumps(row["value"])}">' in text
    assert (
        text.count('<svg xmlns="http://www.w3.org/2000/svg"') == 2 + 3 * 2
    )  # sketch, parts of the distance; value, error, work per mode
    assert {f"{SCENE.name}_mode_{mode}_ancf_reference_percent" for mode in (1, 2)} <= set(content["figures"])
    assert {entry["unit"] for name, entry in content["figures"].items() if name.endswith("frequency")} == {"Hz"}
    assert "frequency of mode 2 (Hz)" in text and "height of" not in text and "z = 0" not in text
    assert [job.view for job in drawn] == ["mesh"] * 2 + ["mode"] * 4
    assert "mode 2, 43.3125 Hz; size and sign mean nothing" in drawn[4].caption
    np.testing.assert_allclose(drawn[4].outline.displacement[2, 2], 0.1 * np.sqrt(2))
