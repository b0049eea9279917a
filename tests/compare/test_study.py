"""Studies with a fake solver: order, reuse, failures, what invalidates a result."""

import ast
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import fake_solver
import numpy as np
import pytest
from fake_solver import FAKE, small

from compare import study
from compare.result import load as load_result
from compare.result import save
from compare.scene import SceneError


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A study of three units in one process at a time: (scene, folder, entries, states that were reported)."""
    scene, folder, states = small((2, 3), (0.4,)), tmp_path_factory.mktemp("results"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OMP_NUM_THREADS", "7")
        patch.setenv("FAKE_SOLVER", "print 0.5")
        entries = study.run([scene], FAKE, "quick", folder, jobs=1, report=states.append)
    return scene, folder, entries, states


def test_entries_come_in_ladder_order_with_time_and_memory(ran):
    _, folder, entries, _ = ran
    assert [study.level_name(entry.level) for entry in entries] == ["2x2", "3x3", "h=0.4"]
    for entry in entries:
        assert (entry.status, entry.fresh, entry.variant) == ("ok", True, None)
        assert entry.repeats == 3  # cheap
        assert 0 < entry.wall_seconds < 2
        assert 20 < entry.result.peak_mb < 1000
    assert {path.name for path in folder.iterdir()} == {f"{entry.key}.npz" for entry in entries}


def test_the_longest_unit_is_started_first(ran):
    assert [study.level_name(entry.level) for entry in ran[3][-1].finished] == ["3x3", "h=0.4", "2x2"]


def test_workers_have_one_thread_each_whatever_the_environment_says(ran):
    assert [entry.result.facts["threads"] for entry in ran[2]] == [1, 1, 1]


def test_progress_counts_to_the_end(ran):
    states = ran[3]
    assert len(states[0].finished) == 0
    assert len(states[-1].finished) == states[-1].total == 3
    assert states[-1].running == ()
    assert all(len(a.finished) <= len(b.finished) for a, b in pairwise(states))
    assert {fraction for state in states for _, fraction in state.running} <= {0, 0.5}
    assert all(state.seconds_left is None or 0 <= state.seconds_left < 60 for state in states)


def test_a_second_run_reuses_everything_without_starting_a_process(ran, monkeypatch):
    scene, folder, first, _ = ran
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
    second = study.run([scene], FAKE, "quick", folder)
    assert not any(entry.fresh for entry in second)
    for name in ("wall_seconds", "repeats", "status", "key"):
        assert [getattr(entry, name) for entry in second] == [getattr(entry, name) for entry in first]


def test_what_is_timed_runs_alone_and_what_was_not_is_run_again(tmp_path):
    """Levels of the ladder, whose times a page compares, without another unit beside them; a variant beside others."""
    variants = [{"name": "v", "set": {"thickness": 0.06}}]
    level = {"mesh": [2, 2], "time_step": 0.02}
    changes = {"sensitivity": {"ancf": level, "variants": variants, "budget": "quick"}}
    units = study.plan([small((2, 3)).override(changes)], FAKE, "quick")
    told = study.solve(units, tmp_path, 2)
    assert {entry.result.facts["beside"] for entry in told} == {1.0}
    timed = study.solve(units, tmp_path, 2, timed=True)
    assert [(e.variant is None, e.result.facts["beside"]) for e in timed if e.variant != study.AS_STATED] == [
        (True, 0.0), (True, 0.0), (False, 1.0)
    ]  # fmt: skip
    assert [entry.fresh for entry in timed if entry.variant == "v"] == [False]
    assert not any(entry.fresh for entry in study.solve(units, tmp_path, 2, timed=True))
    assert not any(entry.fresh for entry in study.solve(units, tmp_path, 2))


def test_reuse_can_be_declined(ran):
    _, folder, _, _ = ran
    assert study.run([small()], FAKE, "quick", folder, reuse=False)[0].fresh


@pytest.mark.parametrize(
    ("status", "again"),
    [("gmsh_missing", True), ("gmsh_busy", True), ("out_of_memory", True), ("newton_diverged", False)],
)
def test_a_failure_of_the_machine_is_solved_again_and_one_of_the_solver_is_kept(tmp_path, status, again):
    (unit,) = study.plan([small()], {"ancf": "fake_solver"}, "quick")
    failed = replace(fake_solver.solve(unit.scene, unit.level), status=status)
    save(failed, tmp_path / f"{unit.key}.npz")
    (entry,) = study.solve([unit], tmp_path)
    assert (entry.fresh, entry.status) == (again, "ok" if again else status)
    assert load_result(tmp_path / f"{unit.key}.npz").status == entry.status


def test_crashes_are_entries_and_the_others_finish(tmp_path, monkeypatch):
    """Without an estimate, too: the environment asks the solver to refuse it."""
    monkeypatch.setenv("FAKE_SOLVER", "no estimate;raise 0.5;kill 0.25;exit 0.2")
    most = []
    meshes = (2, 4, 5, 1)
    entries = study.run([small(meshes)], FAKE, "quick", tmp_path, report=lambda state: most.append(len(state.running)))
    assert [entry.status for entry in entries] == [
        "crashed: ValueError: asked to raise",
        "crashed: killed by SIGKILL",
        "crashed: exit status 3",
        "ok",
    ]
    assert "Traceback" in entries[0].message
    assert "fake_solver.py" in entries[0].message
    assert (entries[1].result, entries[1].wall_seconds, entries[1].repeats) == (None, None, 0)
    assert max(most) == 2
    # nothing of a crash is kept, so that the next run tries again
    assert [path.stem for path in tmp_path.iterdir()] == [entries[3].key]


def test_units_that_would_not_fit_into_memory_run_one_at_a_time(tmp_path, monkeypatch):
    most = []
    monkeypatch.setattr(study.pool, "physical_mb", lambda: 1.5)  # two units of 1 MB exceed the share of it
    study.run([small((2, 3))], FAKE, "quick", tmp_path, report=lambda state: most.append(len(state.running)))
    assert max(most) == 1


def test_a_unit_far_beyond_the_memory_is_refused_at_once_and_the_others_run(tmp_path, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", "huge 0.25")
    first = []
    entries = study.run([small((2, 4, 3))], FAKE, "quick", tmp_path, report=lambda state: first.extend(state.finished))
    assert [entry.status for entry in entries] == ["ok", "too_large: needs about 1,000 GiB of memory", "ok"]
    assert "this machine has" in entries[1].message and entries[1].result is None
    assert first[0].key == entries[1].key


def test_a_lone_unit_is_refused_too_unless_any_size_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", "huge 0.25")
    units = study.plan([small((4,))], FAKE, "quick")
    assert study.solve(units, tmp_path)[0].status.startswith("too_large")
    assert study.solve(units, tmp_path, any_size=True)[0].ok


def test_an_estimate_beyond_the_memory_by_less_than_its_own_error_is_not_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(study.pool, "physical_mb", lambda: 0.7)  # a unit is expected to need 1 MB
    assert study.run([small()], FAKE, "quick", tmp_path)[0].ok


def test_a_label_names_the_element_where_the_ladders_have_several():
    two = {"time_step": 0.02, "levels": [{"mesh": [2, 2]}, {"mesh": [2, 2], "element": "conforming"}]}
    units = study.plan([small(ancf=two, sizes=(0.4,))], FAKE, "full")
    assert [unit.label for unit in units] == [
        "cantilever: ancf 2x2 enriched, 7x7x3 points",
        "cantilever: ancf 2x2 conforming, 7x7x3 points",
        "cantilever: reference h=0.4",
    ]
    assert study.plan([small()], FAKE, "full")[0].label == "cantilever: ancf 2x2, 7x7x3 points"


def test_titles_and_budgets_do_not_invalidate_but_physics_and_levels_do():
    def keys(**changes):
        return [unit.key for unit in study.plan([small((2, 3), (0.4,), **changes)], FAKE, "full")]

    stated = keys()
    assert len(set(stated)) == 3
    assert keys(title="another title", published=None, **{"ancf.levels.0.budget": "full"}) == stated
    assert not {*keys(**{"material.youngs_modulus": 2.1e6})} & {*stated}
    assert [a == b for a, b in zip(keys(**{"ancf.levels.0.points": [4, 4, 4]}), stated, strict=True)] == [
        False,
        True,
        True,
    ]


def test_editing_the_solver_computes_again(tmp_path, monkeypatch):
    """The edit has another length: Python tells compiled modules by it, and by the second of the edit."""
    package = tmp_path / "edited_solver"
    package.mkdir()
    (package / "__init__.py").touch()
    shutil.copy(fake_solver.__file__, package / "run.py")
    monkeypatch.syspath_prepend(tmp_path)
    solvers = {"ancf": "edited_solver.run"}
    before = study.run([small()], solvers, "quick", tmp_path / "results")
    (package / "run.py").write_text((package / "run.py").read_text().replace("-0.5 -", "-0.60 -"))
    after = study.run([small()], solvers, "quick", tmp_path / "results")
    assert all(entry.fresh for entry in after)
    assert after[0].result.displacement[-1, 0, 2] < before[0].result.displacement[-1, 0, 2] - 0.05


def test_a_solver_edited_while_it_runs_leaves_no_result(tmp_path, monkeypatch):
    shutil.copy(fake_solver.__file__, tmp_path / "moving_solver.py")
    monkeypatch.syspath_prepend(tmp_path)

    def edit(progress):
        if progress.running:
            (tmp_path / "moving_solver.py").open("a").write("# edited\n")

    entry = study.run([small()], {"ancf": "moving_solver"}, "quick", tmp_path / "results", report=edit)[0]
    assert entry.status == "crashed: the solver's source changed while it ran"
    assert list((tmp_path / "results").iterdir()) == []


def test_another_library_version_computes_again(monkeypatch):
    before = study.fingerprint("reference", "fake_solver")
    monkeypatch.setattr(study, "version", lambda library: "99" if library == "gmsh" else "1")
    changed = study.fingerprint("reference", "fake_solver")
    monkeypatch.setattr(study, "version", lambda library: "98" if library == "gmsh" else "1")
    assert len({before, changed, study.fingerprint("reference", "fake_solver")}) == 3


def test_a_result_depends_on_every_file_that_states_its_question():
    """What scene and result load, but for the words of errors, the writing of files and treads, whose grooves a
    question holds."""
    words = "import sys, compare.scene, compare.result; print(*(m for m in sys.modules if m.startswith('compare.')))"
    run = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    told = {f"{name.removeprefix('compare.')}.py" for name in run.stdout.split()}
    assert set(study.CONTRACT) == told - {"scene_errors.py", "files.py", "treads.py"}


@pytest.mark.parametrize(("solver", "package"), [("ancf", "ancf"), ("reference", "reference_fe")])
def test_a_result_depends_on_every_library_that_its_solver_computes_with(solver, package):
    """Whatever its sources import, but the standard library, the project itself and the setting of threads."""
    used = set()
    for path in study.source_files(package):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) else []
            used |= {name.partition(".")[0] for name in names}
    used -= {*sys.stdlib_module_names, package, "compare", "threadpoolctl"}
    assert {"scikit-fem" if name == "skfem" else name for name in used} <= set(study.LIBRARIES[solver])


def test_a_damaged_result_is_computed_again(tmp_path):
    key = study.run([small()], FAKE, "quick", tmp_path)[0].key
    (tmp_path / f"{key}.npz").write_bytes(b"half a file")
    assert [entry.fresh for entry in study.run([small()], FAKE, "quick", tmp_path)] == [True]


def test_a_result_that_cannot_be_read_back_is_a_crash(tmp_path):
    unit = study.plan([small()], FAKE, "quick")[0]
    entry = study._finished(study.pool.Outcome(unit, None), tmp_path)
    assert (entry.status, entry.result) == ("crashed: no readable result", None)
    assert unit.key in entry.message


def test_a_solver_that_reports_failure_is_kept_with_its_status(tmp_path, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", "fail 0.5")
    for fresh in (True, False):
        entry = study.run([small()], FAKE, "quick", tmp_path)[0]
        assert (entry.status, entry.ok, entry.fresh) == ("newton_diverged", False, fresh)


def test_a_missing_solver_is_an_entry(tmp_path):
    entries = study.run([small()], {"ancf": "no_such_solver.run"}, "quick", tmp_path)
    assert all(entry.status.startswith("crashed: ModuleNotFoundError") for entry in entries)


def test_variants_are_run_beside_the_scene_as_stated(tmp_path):
    level = {"mesh": [2, 2], "time_step": 0.02}
    variants = [{"name": "soft", "set": {"material.youngs_modulus": 1e6}}]
    scene = small(sensitivity={"budget": "standard", "ancf": level, "variants": variants})
    assert [unit.variant for unit in study.plan([scene], FAKE, "quick")] == [None]
    entries = study.run([scene], FAKE, "standard", tmp_path)
    assert [entry.variant for entry in entries] == [None, "as stated", "soft"]
    assert entries[2].scene.material.youngs_modulus == 1e6
    assert entries[2].result.displacement[-1, 0, 2] == pytest.approx(-0.5 - 1e-3 * 1.25)


def test_equal_units_are_solved_once(tmp_path):
    level = {"mesh": [2, 2], "time_step": 0.02}
    variants = [{"name": "soft", "set": {"material.youngs_modulus": 1e6}}]
    scene = small(sensitivity={"budget": "quick", "ancf": {**level, "points": [7, 7, 3]}, "variants": variants})
    entries = study.run([scene], {"ancf": "fake_solver"}, "quick", tmp_path)
    assert entries[0].key == entries[1].key
    assert len(list(tmp_path.iterdir())) == 2


def test_a_wrong_variant_is_refused_before_anything_runs(tmp_path):
    with pytest.raises(SceneError):
        variants = [{"name": "odd", "set": {"no_such_key": 1}}]
        level = {"mesh": [2, 2], "time_step": 0.02}
        study.run([small(sensitivity={"ancf": level, "variants": variants})], FAKE, "standard", tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_interrupt_keeps_finished_results_and_ends_the_workers(tmp_path):
    script = (
        "import signal, sys; sys.path.insert(0, sys.argv[1])\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background job ignores it
        "from pathlib import Path; from compare import study; from fake_solver import FAKE, small\n"
        "study.run([small((2, 3))], FAKE, 'quick', Path(sys.argv[2]), jobs=1,\n"
        "    report=lambda p: print(len(p.finished), p.running, flush=True))\n"
    )
    here = str(Path(__file__).parent)
    environment = {**os.environ, "FAKE_SOLVER": "sleep 0.5", "FAKE_SOLVER_ID": str(tmp_path / "asleep")}
    with subprocess.Popen(
        [sys.executable, "-c", script, here, str(tmp_path)], stdout=subprocess.PIPE, env=environment, text=True
    ) as process:
        for text in process.stdout:
            if text.startswith("1 ") and (tmp_path / "asleep").exists():
                process.send_signal(signal.SIGINT)
                break
        assert process.wait(timeout=20) != 0
    assert len(list(tmp_path.glob("*.npz"))) == 1
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "asleep").read_text()), 0)


def test_a_killed_save_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "result.npz"
    made = fake_solver.solve(small(), small().ancf.levels[0])
    save(made, path)
    monkeypatch.setattr("numpy.savez_compressed", lambda *_, **__: (_ for _ in ()).throw(OSError("disc full")))
    with pytest.raises(OSError, match="disc full"):
        save(made, path)
    assert load_result(path).unknowns == made.unknowns


def test_a_path_keeps_its_load_parameter_and_older_files_have_none(tmp_path):
    made = fake_solver.solve(small(), small().ancf.levels[0])
    for name, parameter in (("path", np.array([0.0, 0.7, -0.2])), ("plain", None)):
        save(replace(made, load_parameter=parameter), tmp_path / name)
        read = load_result(tmp_path / name)
        np.testing.assert_array_equal(read.load_parameter, parameter)
        assert read.status == made.status
    with np.load(tmp_path / "plain") as file:
        assert "load_parameter" not in file.files and "load_parameter" not in str(file["header"])


def test_time_left_is_the_rest_at_the_pace_of_each_solver():
    units = study.plan([small((2, 3, 4), (0.4,))], FAKE, "quick")
    costs = {unit.key: cost for unit, cost in zip(units, (1.0, 2.0, 3.0, 10.0), strict=True)}
    running = [SimpleNamespace(about=units[1], fraction=0.5, began=0.0)]
    # ancf has shown 4 s per cost: half of 2 and all of 3 are left, then 10 at the 1 s of the reference
    paces = {"ancf": [3.0, 5.0], "reference": [1.0]}
    assert study.pool.seconds_left(running, units[2:], costs, paces, jobs=2) == pytest.approx(4 + 12 + 10)
    assert study.pool.seconds_left(running, units[2:], costs, {"ancf": [4.0]}, jobs=2) is None
