"""Many scenes: one list of units, one table, and the workflow that runs the same units elsewhere."""

import csv
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from test_cli import SCENE

from compare import cli, study

ROOT = Path(__file__).parents[2]
SNAKEFILE = ROOT / "workflow" / "Snakefile"
SPEC = importlib.util.spec_from_file_location("same", ROOT / "workflow" / "same.py")
same = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(same)


@pytest.fixture
def scenes(tmp_path, monkeypatch):
    """Three scenes of another thickness each, for the fake solver."""
    monkeypatch.setattr(cli, "SOLVERS", {"ancf": "fake_solver"})
    monkeypatch.chdir(tmp_path)
    paths = []
    for n in range(3):
        path = tmp_path / f"plate{n}.toml"
        text = SCENE.format(companions="").replace('"plate"', f'"plate{n}"').replace("0.05", f"0.0{n + 4}")
        path.write_text(text)
        paths.append(str(path))
    return paths


def test_a_sweep_is_one_table_and_one_page(scenes, capsys):
    assert cli.main(["sweep", *scenes]) == 0
    assert "3 scenes, 6 rows" in capsys.readouterr().out
    rows = list(csv.DictReader(Path("reports/build/sweep.csv").open()))
    assert [row["scene"] for row in rows] == ["plate0"] * 2 + ["plate1"] * 2 + ["plate2"] * 2
    page = Path("reports/build/sweep.html").read_text()
    assert page.count(rows[0]["value"]) >= 1 and "sweep.html" in Path("reports/build/index.html").read_text()


def test_wrong_scenes_of_a_sweep_are_told_at_once_before_anything_is_solved(scenes, capsys):
    """A key that does not exist, a name that is taken, and a study that makes no page of a scene."""
    other = Path("other.toml")
    other.write_text('study = "speed"\n' + Path(scenes[1]).read_text())
    Path(scenes[1]).write_text(Path(scenes[1]).read_text() + "\ncolour = 'blue'\n")
    Path(scenes[2]).write_text(Path(scenes[2]).read_text().replace("plate2", "plate0"))
    assert cli.main(["sweep", *scenes, str(other)]) == 2
    said = capsys.readouterr().err
    assert "plate1: study = 'speed': reports.speed makes no page" in said
    assert "plate1.toml" in said and "colour" in said and "its name 'plate0' is that of" in said
    assert not Path("reports").exists()


def test_units_are_solved_one_by_one_and_shared_with_a_run(scenes, capsys):
    """What `units` prints, `unit` solves under that key, and a run then reuses."""
    assert cli.main(["units", *scenes]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert [page["name"] for page in plan["pages"]] == ["plate0", "plate1", "plate2"]
    assert len(plan["units"]) == 6 and all(unit["memory_mb"] >= 500 for unit in plan["units"])
    for unit in plan["units"][:2]:
        assert cli.main(["unit", unit["scene"], unit["key"]]) == 0
        assert Path("reports/build/results", f"{unit['key']}.npz").exists()
    assert cli.main(["table", scenes[0]]) == 0
    assert "0 units solved, 2 reused" in capsys.readouterr().err
    assert cli.main(["unit", scenes[0], "0" * 24]) == 2
    assert "plan again" in capsys.readouterr().err


def test_a_failing_unit_is_a_result_and_a_crash_is_not(scenes, capsys, monkeypatch):
    (unit, _) = study.plan(cli.with_companions(scenes[0]), {"ancf": "fake_solver"}, "standard")
    monkeypatch.setenv("FAKE_SOLVER", "fail 0.5")
    assert cli.main(["unit", scenes[0], unit.key, "--fresh"]) == 0
    monkeypatch.setenv("FAKE_SOLVER", "raise 0.5")
    Path("reports/build/results", f"{unit.key}.npz").unlink()
    assert cli.main(["unit", scenes[0], unit.key]) == 1
    assert "newton_diverged" in capsys.readouterr().out


def installed(*modules):
    """Skips where one is missing."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    return pytest.mark.skipif(
        bool(missing), reason=f"not installed: {', '.join(missing)}; pip install groovecheck[workflow]"
    )


@pytest.mark.slow
@installed("snakemake", "snakemake_executor_plugin_cluster_generic")
def test_jobs_that_a_queue_starts_give_what_a_run_gives(tmp_path):
    """Every unit a job script of its own that a submit command takes, as a cluster's does; this one starts them."""
    queue = tmp_path / "submit"
    queue.write_text('#!/bin/sh\nsh "$1" > "$1.log" 2>&1 &\necho $!\n')
    queue.chmod(0o700)
    executor = ("--executor", "cluster-generic", "--cluster-generic-submit-cmd", str(queue), "--jobs", "2")
    flow, plain = same.run("cantilever_plain_patch", "quick", tmp_path, executor)
    found, count = same.differences(flow, plain, "cantilever_plain_patch")
    assert found == [] and count > 2


@pytest.mark.slow
@installed("snakemake", "snakemake_executor_plugin_slurm")
def test_the_profile_for_slurm_is_understood(tmp_path):
    """As far as it goes without a cluster: the plan is made and every job has partition, time, memory and one core."""
    profile, config = ROOT / "workflow" / "profiles" / "slurm", f"command={sys.executable} -m compare.cli"
    words = ["-s", str(SNAKEFILE), "--workflow-profile", str(profile), "--dry-run", "--directory", str(tmp_path)]
    words += ["--config", "scenes=rounded_groove", "budget=quick", f"out={tmp_path / 'out'}", config]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "snakemake", *words]
    run = subprocess.run(command, env=environment, capture_output=True, text=True)
    said = run.stdout + run.stderr
    assert run.returncode == 0, said
    assert said.count("rule unit:") == said.count("slurm_partition=NAME, runtime=120, cpus_per_task=1") - 2 == 3
    assert not (tmp_path / "out" / "results").exists()


@pytest.mark.slow
@installed("snakemake")
def test_the_workflow_gives_what_a_run_gives_number_for_number(tmp_path):
    """Snakemake on two cores and a plain run of the same quick ladder, both from nothing: equal but for times."""
    flow, plain = same.run("cantilever_plain_patch", "quick", tmp_path)
    found, count = same.differences(flow, plain, "cantilever_plain_patch")
    assert found == [] and count > 2
    assert (flow / "index.html").exists()


def test_the_comparison_would_have_told(tmp_path):
    """One last digit of one displacement, a status, a fact and a row are seen; times are not."""
    outs = [tmp_path / "flow", tmp_path / "plain"]
    results = [np.array([1.0, 2.0]), np.nextafter([1.0, 2.0], 3.0)]
    for out, displacement, status in zip(outs, results, ("ok", "failed"), strict=True):
        (out / "results").mkdir(parents=True)
        header = {
            "status": status,
            "level": {"mesh": [2, 2], "budget": out.name},
            "seconds": out.name,
            "facts": {"beside": out.name, "mesh_seconds": out.name, "factor_seconds": out.name, "volume": 1.0},
        }
        np.savez(out / "results" / "a.npz", header=np.array(json.dumps(header)), displacement=displacement)
        (out / "s.json").write_text(json.dumps({"rows": [{"value": 1.0, "wall_seconds": out.name}]}))
    assert same.differences(*outs, "s") == (["a.npz: displacement", "a.npz: status"], 1)
    np.savez(outs[0] / "results" / "a.npz", header=np.array(json.dumps({"facts": {"volume": 1.1}})))
    assert "a.npz: facts" in same.differences(*outs, "s")[0]
    (outs[0] / "s.json").write_text(json.dumps({"rows": [{"value": 2.0}]}))
    assert same.differences(*outs, "s")[0][-1] == "the rows of the pages"
