"""The tire's scene has the size it states, its parts are one tire, and its page judges what it is given."""

import json

import numpy as np
import pytest

from ancf.unpack import build
from compare import gate
from compare.scene import load
from compare.scene_revolved import section_curve
from reports import frame
from reports.hard_cases.chapter import Asked, Outcome
from reports.tire import kernels, limits, page, recorded, runs, study
from reports.tire.scenes import SHARE, tire
from reports.unit import Measured

COARSE = {"mesh": [4, 2], "element": "conforming", "points": [4, 4, 2], "volumetric": "full"}
T = np.linspace(0.0, 0.32, 9)


def test_the_section_has_the_size_that_the_scene_states():
    """45/65 R45: overall diameter 2.629 m, section width 1.143 m, rim diameter 1.143 m, to a millimetre."""
    scene = load("falling_tire")
    (along, radius), (along_u, radius_u) = section_curve(scene.surface, np.linspace(0.0, 1.0, 2001))
    speed = np.hypot(along_u, radius_u)
    outer = along - radius_u / speed * scene.thickness / 2, radius + along_u / speed * scene.thickness / 2
    assert 2 * outer[1].max() == pytest.approx(2.629, abs=1e-3)
    assert 2 * outer[0].max() == pytest.approx(1.143, abs=1e-3)
    assert 2 * radius[-1] == pytest.approx(1.143, abs=1e-9)
    assert 2 * outer[0][-1] == pytest.approx(0.91, abs=1e-9)  # beads, outside to outside
    assert along_u[-1] == pytest.approx(0.0, abs=1e-12)  # the bead's face is a cylinder on the rim


def test_quarter_half_and_whole_are_one_tire():
    """As much material, and after three steps of a landing the same place of node 1, by symmetry."""
    volume, found = {}, {}
    for part, share in SHARE.items():
        volume[part] = share * build(*tire(COARSE, part=part)).body.volume
        found[part] = runs.part(part=part, steps=3, **COARSE)
    assert volume["half"] == pytest.approx(volume["quarter"], rel=1e-12)
    assert volume["whole"] == pytest.approx(volume["quarter"], rel=1e-12)
    for key in ("node_1", "force"):
        values = [found[part][key] for part in SHARE]
        assert values == pytest.approx([values[0]] * 3, rel=1e-8)
    assert found["quarter"]["force"] > 0


def test_the_cost_of_rubber_counts_all_groups_of_elements():
    """Elements with kinks have more functions than those without: both kinds are timed, and counted."""
    found = kernels.rubber(mesh=[2, 5])
    assert found["elements"] == 10 and found["points_per_element"] > 4 * 4 * 3
    assert 0 < found["force_us"] < found["tangent_us"] and 0 < found["force_us_plain"]


def test_the_parts_of_a_tangent_make_it_up():
    """By group; operations of the products, of c columns: twice 6 directions of the even part of pairs i <= k, 3 of the
    odd one, and 9 of all pairs of functions of two factors in z, times c for each combination of their gradients.

    A mid-surface function has two parametric gradients and 3 + 1 combinations with another, a director three and 6 + 3.
    """
    plain, *kinked = kernels.split(mesh=[2, 5])["rows"]
    assert (plain["functions"], plain["points"], plain["elements"]) == (24, 48, 6)
    mid, director, c = 16, 8, 48 / 3
    own = 6 * 3 * mid * (mid + 1) / 2 + 3 * 1 * mid * (mid - 1) / 2
    own += 6 * 6 * director * (director + 1) / 2 + 3 * 3 * director * (director - 1) / 2
    assert plain["operations"] == 2 * c * (own + 9 * 2 * 3 * mid * director)
    assert sum(row["elements"] for row in kinked) == 4
    for row in kinked:
        assert row["functions"] > 24 and row["points"] > 48 and row["operations"] > 2 * plain["operations"]
    for row in (plain, *kinked):
        assert row["whole"] == pytest.approx(row["law"] + row["thickness"] + row["products"])
        assert min(row[part] for part in ("law", "thickness", "products", "blas")) > 0


def test_lines_on_the_knots_hold_the_middle_of_the_wall():
    """Five elements on five spans to round-off, six not; ten miss half the thickness by a quarter of what five do."""
    five, six, ten = (runs.misfit([2, count]) for count in (5, 6, 10))
    assert max(five["middle"], ten["middle"]) < 1e-14 < 1e-4 < six["middle"]
    assert ten["half"] < five["half"] / 3 and five["half"] < 0.05 * 0.06


def _run(size: float, solver: str, error: float, seconds: float, mesh=page.MESH, **more) -> Outcome:
    """A run whose path and numbers differ from a half sine and 1 by `error`."""
    told = {"solver": "reference", "size": size} if solver == "reference" else {"mesh": mesh}
    path = -0.1 * (1 + error) * np.sin(np.pi * T / T[-1])
    values = {
        "ended": "ok", "h": size, "elements": 60, "unknowns": 99, "cpu_seconds": seconds, "times": T.tolist(),
        "node_1": path.tolist(), "force": (-path).tolist(), "area": (-path).tolist(),
        "ratio": (1 + error * path).tolist(), "travel": 0.1 * (1 + error), "peak_force": 1 + error,
        "footprint": 1 + error, "energy_residual": 0.1, "finite": True,
    }  # fmt: skip
    return Outcome(Asked("tire.runs.drop", told), Measured("tire.runs.drop", told, "ok", values | more))


def _unit(name: str, values: dict, **arguments) -> Outcome:
    return Outcome(Asked(name, arguments), Measured(name, arguments, "ok", values))


def _found() -> dict[str, list[Outcome]]:
    solids = [_run(h, "reference", -0.1 * h**2, 100 / h**2) for h in (1.0, 0.5, 0.25)]
    rubber = {"force_us": 8.0, "tangent_us": 70.0, "force_us_plain": 4.0, "tangent_us_plain": 30.0}
    parts = [
        _unit("part", {"node_1": -0.03, "elements": 8, "unknowns": 9, "cpu_per_step": 0.1, "memory": 99.0}, part=p)
        for p in SHARE
    ]
    return {
        "drop": [*solids, _run(0.3, "ancf", -0.025, 20.0)],
        "off knots": [_run(0.3, "ancf", -0.01, 25.0, page.OFF_KNOTS)],
        "smooth": [_run(0.3, "ancf", -0.06, 15.0)],
        "print": [],
        "saved": parts,
        "hard": [_run(0.3, "ancf", 0.0, 1.0, energy_residual=9.0)],
        "kernels": [_unit("rubber", rubber | {"points_per_element": 100.0})],
    }


def test_the_page_finds_the_limit_its_errors_and_the_cost_at_equal_error(tmp_path):
    """Errors fall with h squared and the cost with its square: 2.5 % at h = 0.5, which takes 400 s."""
    judged = {figure.name: figure for figure in page.figures(_found())}
    assert judged["height_difference_percent"].value == pytest.approx(2.5, rel=1e-6)
    assert judged["peak_force_percent"].value == pytest.approx(2.5, rel=1e-6) and judged["peak_force_percent"].met
    assert judged["cost_ratio"].value == pytest.approx(400 / 20.0, rel=1e-6)
    assert judged["off_knots_height_percent"].value == pytest.approx(1.0, rel=1e-6)
    assert judged["smooth_height_percent"].value == pytest.approx(6.0, rel=1e-6)
    assert judged["tangent_us"].met is False and judged["force_us"].met
    assert judged["hard_cases_failed"].value == 1  # its energy drifts by 9 % under the name ok
    path = study.publish(_found(), "quick", tmp_path)
    assert "Node 1" in path.read_text() and json.loads(path.with_suffix(".json").read_text())["budget"] == "quick"


def _record(tmp_path, monkeypatch, *solids: Outcome):
    """The solids as a full study records them."""
    path = tmp_path / "solids.json"
    recorded.write(solids, "a test", path)
    held = recorded.read(path)
    monkeypatch.setattr(recorded, "read", lambda: held)


def _judged(solids: list[Outcome], *plates: tuple[float, list[int]]) -> tuple[dict, dict]:
    """Figures of runs whose errors fall with h squared, plates of 20 s at h = 0.5 whose cost grows with h^-4."""
    own = [_run(h, "ancf", -0.1 * h**2, 20.0 * (0.5 / h) ** 4, mesh) for h, mesh in plates]
    found = _found() | {"drop": [*solids, *own]}
    return found, {figure.name: figure for figure in page.figures(found)}


def test_a_short_ladder_goes_on_with_the_recorded_solids(tmp_path, monkeypatch):
    """Two solids show no order, recorded ones do: the plate is 2.5 % from their limit instead of 0.9 % from 0.4 m.

    Costs are those of solids that were run. They reach 1.6 %: for a plate at 2.5 % its own 20 s count, against 400 s;
    for one at 0.4 % the 20 (0.5 / 0.4)^4 s of the line through two plates, against 625 s.
    """
    every = [_run(h, "reference", -0.1 * h**2, 100 / h**2) for h in (0.5, 0.4, 0.32, 0.25)]
    plates = (1.0, [6, 3]), (0.5, page.MESH)
    alone = _judged(every[:2], *plates)[1]
    assert alone["height_difference_percent"].value == pytest.approx(100 * 0.009 / 0.984, rel=1e-6)
    _record(tmp_path, monkeypatch, *every)
    found, judged = _judged(every[:2], *plates)
    assert judged["height_difference_percent"].value == pytest.approx(2.5, rel=1e-4)
    assert "h = 0.25 m" in judged["height_difference_percent"].note
    assert judged["cost_ratio"].value == pytest.approx(400 / 20.0, rel=1e-4)
    path = study.publish(found, "quick", tmp_path)
    told = path.read_text()
    assert "size 0.25, recorded" in told and "h = 0.32, 0.25 m, recorded on" in told and "limit of the solids" in told
    rows = json.loads(path.with_suffix(".json").read_text())["rows"]
    assert [row["h"] for row in rows if row["part"] == "recorded"] == [0.32, 0.25]
    judged = _judged(every[:2], (0.4, [6, 3]), (0.2, page.MESH))[1]
    assert judged["height_difference_percent"].value == pytest.approx(0.4, rel=1e-4)
    assert judged["cost_ratio"].value == pytest.approx(625 / (20 * 1.25**4), rel=1e-4)
    judged = _judged(every[:2], (0.2, page.MESH))[1]
    assert judged["cost_ratio"].value is None and "No run of the plate" in judged["cost_ratio"].note


def test_a_record_of_another_tire_is_not_used(tmp_path, monkeypatch):
    """Where a solid that was run differs from the recorded one, in what was asked too, and where none is the same."""
    every = [_run(h, "reference", -0.1 * h**2, 100 / h**2) for h in (1.0, 0.5, 0.4, 0.25)]
    _record(tmp_path, monkeypatch, *every[:1], *every[2:])
    assert [o.get("h") for o in recorded.beyond(every[:2]).solids] == [0.4, 0.25]
    assert recorded.beyond(every) == ((), "") and "none was run" in recorded.beyond(every[:0]).words
    assert not recorded.beyond(every[1:2]).solids
    for key in (*recorded.NUMBERS, *recorded.PATHS, "times"):
        other = _run(1.0, "reference", -0.1, 100.0)
        other.measured.values[key] = (np.array(other.get(key)) * 1.001).tolist()
        solids, words = recorded.beyond([other])
        assert not solids and (key.replace("_", " ") in words or (key == "times" and "another question" in words))
    other.asked.arguments["until"] = 0.4
    assert "another question" in recorded.beyond([other]).words


def test_the_record_is_of_the_shipped_tire():
    """Its solids are those of the full budget; the gate knows what the coarsest of them finds."""
    held = recorded.read().solids
    assert tuple(o.get("h") for o in held) == study.SIZES["full"]
    rows = {row["case"]: row["value"] for row in gate.read(frame.BASELINES / "tire.json")["rows"]}
    for key in ("travel", "peak_force"):
        assert held[0].get(key) == pytest.approx(rows[f"drop: size 0.22: {key}"], rel=1e-6)
    assert limits.Ladder(held).convergence("travel").extrapolated is not None


def test_only_all_solids_of_a_full_study_are_recorded(tmp_path, monkeypatch, capsys):
    """One that is missing, or a number that is none, leaves the record as it is; the page is written before."""
    monkeypatch.setattr(study, "publish", lambda *_: tmp_path)
    words, kept = ["--budget", "full", "--record", "why"], []
    monkeypatch.setattr(recorded, "write", lambda outcomes, reason: kept.append(reason))
    for solids, status in ((study.SIZES["full"], 0), (study.SIZES["full"][:-1], 1)):
        found = _found() | {"drop": [_run(h, "reference", -(h**2), 1 / h) for h in solids]}
        monkeypatch.setattr(study, "run", lambda *_, found=found: found)
        monkeypatch.setattr(study.page, "figures", lambda found: [])
        assert study.main(words) == status
    assert kept == ["why"] and "not recorded" in capsys.readouterr().err
    with pytest.raises(ValueError, match="JSON"):
        monkeypatch.undo()
        recorded.write([_run(1.0, "reference", float("nan"), 1.0)], "why", tmp_path / "r.json")
    assert not (tmp_path / "r.json").exists()


@pytest.mark.parametrize("words", [["--budget", "quick", "--record", "why"], ["--budget", "full", "--record", " "]])
def test_only_a_full_study_records_and_says_why(words, capsys):
    with pytest.raises(SystemExit) as ended:
        study.main(words)
    assert ended.value.code == 2 and "--record" in capsys.readouterr().err


def test_the_gate_knows_each_fall_by_its_case_and_how_it_ended():
    rows = {(row["case"], row["solver"]): row for row in study.gate_rows(_found())}
    travel = rows["drop: size 0.25: travel", "reference"]
    assert travel["value"] == pytest.approx(0.1 * (1 - 0.1 * 0.25**2)) and travel["status"] == "ok"
    assert rows["saved: part whole: node_1", "ancf"]["value"] == -0.03
    failed = _found() | {"hard": [_run(0.3, "ancf", 0.0, 1.0, ended="newton_diverged")]}
    ended = {row["status"] for row in study.gate_rows(failed) if row["case"].startswith("hard: ")}
    assert ended == {"newton_diverged"}
    judged = {figure.name: figure for figure in page.figures(failed)}
    assert judged["hard_cases_failed"].value == 1


def test_without_a_reference_nothing_is_judged_against_it():
    found = _found()
    found["drop"] = found["drop"][-1:]
    judged = {figure.name: figure for figure in page.figures(found)}
    names = ("height_difference_percent", "peak_force_percent", "footprint_percent", "cost_ratio")
    assert all(judged[name].value is None and judged[name].met is None for name in names)


def test_a_ladder_of_one_has_its_own_value_for_a_limit():
    only = limits.ladder(_found()["drop"][2:3], "reference")
    assert only.limit("travel")[0] == only.outcomes[0].get("travel")
    assert np.array_equal(page.path_limit(only), only.outcomes[0].get("node_1"))
    assert limits.cost_at([1.0], [2.0], 0.5) is None and limits.cost_at([1.0, 0.0], [2.0, 3.0], 0.5) is None


def test_a_unit_that_crashes_fails_the_study_and_is_named(monkeypatch, tmp_path, capsys):
    """Also one that no figure needs, such as what an omission saves, and with a gate that passes."""
    asked = Asked("tire.savings.repeated", {"mesh": [12, 5]})
    broken = Outcome(asked, Measured(asked.name, asked.arguments, "failed: TypeError: 'mirrors'"))
    monkeypatch.setattr(study, "publish", lambda *_: tmp_path)
    monkeypatch.setattr(study.page, "figures", lambda found: [])
    monkeypatch.setattr(study.frame, "passed", lambda *_: True)
    for found, status in (({"omitted": []}, 0), ({"omitted": [broken]}, 1)):
        monkeypatch.setattr(study, "run", lambda budget, jobs, take, found=found: found)
        assert study.main(["--budget", "quick", "--check"]) == status
    told = capsys.readouterr().err
    assert "tire.savings.repeated" in told and "failed: TypeError" in told
