"""Many scenes: one list of units, one table, and the workflow that runs the same units elsewhere."""

import csv
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from test_cli import SCENE

from compare import cli, study
from compare.result import load

ROOT = Path(__file__).parents[2]
SNAKEFILE = ROOT / "workflow" / "Snakefile"


@pytest.fixture
def scenes(tmp_path, monkeypatch):
    """Three scenes of another thickness each, for the fake solver."""
    monkeypatch.setattr(cli, "SOLVERS", {"ancf": "fake_solver"})
    monkeypatch.chdir(tmp_path)
    paths = []
    for n in range(3):
        path = tmp_path / f"plate{n}.toml"
        text = SCENE.format(companions="").replace('"plate"', f'"plate{n}"').replace("0.05", f"0.0{n + 4}")
        path.write_text(text.replace('study = "none_such"\n', ""))
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
    """A key that does not exist, and a name that is taken."""
    Path(scenes[1]).write_text(Path(scenes[1]).read_text() + "\ncolour = 'blue'\n")
    Path(scenes[2]).write_text(Path(scenes[2]).read_text().replace("plate2", "plate0"))
    assert cli.main(["sweep", *scenes]) == 2
    said = capsys.readouterr().err
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


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("snakemake") is None and shutil.which("snakemake") is None,
    reason="snakemake is not installed: pip install groovecheck[workflow]",
)
def test_the_workflow_gives_what_a_run_gives_number_for_number(tmp_path):
    """Snakemake on two cores and a plain run of the same quick ladder, both from nothing: equal but for times."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    command = f"{sys.executable} -m compare.cli"
    engine = [sys.executable, "-m", "snakemake"] if importlib.util.find_spec("snakemake") else ["snakemake"]
    config = [f"out={tmp_path / 'flow'}", "scenes=cantilever_plain_patch", "budget=quick", f"command={command}"]
    words = [*engine, "-s", str(SNAKEFILE), "--cores", "2", "--config", *config, "--directory", str(tmp_path)]
    subprocess.run(words, check=True, env=environment, capture_output=True, timeout=600)
    plain = ["run", "cantilever_plain_patch", "--budget", "quick", "--out", str(tmp_path / "plain")]
    subprocess.run([*command.split(), *plain], check=True, env=environment, capture_output=True, timeout=600)
    found = {path.name: load(path) for path in (tmp_path / "flow" / "results").glob("*.npz")}
    known = {path.name: load(path) for path in (tmp_path / "plain" / "results").glob("*.npz")}
    assert found.keys() == known.keys() and len(known) > 2
    for name, result in known.items():
        if result.solver == "ancf":
            assert found[name].displacement.tobytes() == result.displacement.tobytes()
        # the reference's sparse solver (MKL) rounds by how memory happens to lie: 2e-15 m was seen in one unit of 36
        np.testing.assert_allclose(found[name].displacement, result.displacement, rtol=0, atol=1e-12)
        assert (found[name].status, found[name].unknowns) == (result.status, result.unknowns)
    pages = [json.loads((tmp_path / out / "cantilever_plain_patch.json").read_text()) for out in ("flow", "plain")]
    values = [[row["value"] for row in page["rows"]] for page in pages]
    np.testing.assert_allclose(values[0], values[1], rtol=0, atol=1e-12)
    assert (tmp_path / "flow" / "index.html").exists()
