"""The groovecheck command: exit codes, what goes where, and what it does not load."""

import csv
import io
import json
import os
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import pytest

from compare import cli, cli_gate, export, gate, pool
from compare.explain import _cost
from compare.scene import SHIPPED
from compare.table import KEYS

SCENE = """
name = "plate"
title = "A small plate"
thickness = 0.05
companions = [{companions}]
surface = {{ kind = "rectangle", length = 1.0, width = 1.0 }}
material = {{ kind = "svk", youngs_modulus = 2.0e6, density = 2000.0 }}
supports = [{{ kind = "clamp", edge = "x0" }}]
loads = [{{ kind = "point", at = [1.0, 1.0], force = [0.0, 0.0, -50.0] }}]
probes = [{{ name = "P", at = [1.0, 1.0, 0.0] }}]
analysis = {{ kind = "dynamic", until = 1.0, every = 0.5 }}
ancf = {{ time_step = 0.5, levels = [{{ mesh = [2, 2], budget = "quick" }}, {{ mesh = [3, 3] }}] }}
"""


@pytest.fixture
def plate(tmp_path, monkeypatch):
    """Path of a scene; the command runs the fake solver and keeps baselines in a folder of the test."""
    path = tmp_path / "plate.toml"
    path.write_text(SCENE.format(companions=""))
    monkeypatch.setattr(cli, "SOLVERS", {"ancf": "fake_solver", "reference": "fake_solver"})
    monkeypatch.setattr(cli_gate, "_baseline", lambda scene: tmp_path / "baselines" / f"{scene.name}.json")
    monkeypatch.chdir(tmp_path)
    return path


def test_table_prints_rows_to_stdout_and_everything_else_to_stderr(plate, capsys):
    assert cli.main(["table", str(plate), "--format", "json"]) == 0
    seen = capsys.readouterr()
    found = json.loads(seen.out)
    assert [row["mesh"] for row in found] == ["2x2", "3x3"]
    assert tuple(found[0]) == KEYS
    assert "[2/2]" in seen.err
    assert "2 units solved, 0 reused" in seen.err
    assert cli.main(["table", str(plate), "--format", "csv"]) == 0
    seen = capsys.readouterr()
    assert len(list(csv.DictReader(io.StringIO(seen.out)))) == 2
    assert "0 units solved, 2 reused" in seen.err


def test_budget_and_out_are_obeyed(plate, capsys):
    assert cli.main(["table", str(plate), "--budget", "quick", "--out", "elsewhere"]) == 0
    assert capsys.readouterr().out.count("\n") == 3
    assert len(list(Path("elsewhere/results").glob("*.npz"))) == 1
    assert not Path("reports").exists()


def test_run_prints_the_table_and_says_where_the_page_is(plate, capsys, monkeypatch):
    calls = []

    class Study:
        __spec__ = cli.importlib.util.find_spec("reports.scene")

        @staticmethod
        def publish(scene, entries, rows, folder):
            calls.append((scene.name, len(entries), len(rows), folder))
            return folder / "plate.html"

    monkeypatch.setitem(sys.modules, "reports.scene", Study)
    assert cli.main(["run", str(plate), "--budget", "quick", "--solver", "ancf"]) == 0
    seen = capsys.readouterr().out
    assert "-0.50250" in seen
    assert "page: reports/build/plate.html" in seen
    assert calls == [("plate", 1, 1, Path("reports/build"))]


@pytest.mark.parametrize("study", ["none_such", "speed", "frame", "tire", "sweep"])
@pytest.mark.parametrize("command", [("run",), ("run", "--solver", "ancf"), ("table",), ("sweep", "--pages")])
def test_what_makes_no_page_of_a_scene_is_refused_as_its_study(plate, capsys, study, command):
    plate.write_text(f'study = "{study}"\n' + plate.read_text())
    name, *more = command
    assert cli.main([name, str(plate), *more]) == 2
    assert f"plate: study = '{study}': reports.{study} makes no page of a scene" in capsys.readouterr().err
    assert not list(Path().rglob("*.npz"))


def test_a_failed_unit_exits_1_and_says_which(plate, capsys, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", "raise 0.5")
    assert cli.main(["table", str(plate), "--format", "json"]) == 1
    seen = capsys.readouterr()
    assert [row["status"] for row in json.loads(seen.out)] == ["crashed: ValueError: asked to raise", "ok"]
    assert "failed: plate: ancf 2x2, 7x7x3 points: crashed: ValueError: asked to raise" in seen.err


def test_check_passes_after_accept_and_refuses_a_moved_row_by_name(plate, capsys):
    assert cli.main(["check", str(plate)]) == 2
    assert "no baseline yet" in capsys.readouterr().err
    assert cli.main(["accept", str(plate), "--reason", "first"]) == 0
    assert cli.main(["check", str(plate)]) == 0
    seen = capsys.readouterr()
    assert "change 0.00e+00 = 0 % of tolerance" in seen.out
    plate.write_text(plate.read_text().replace("2.0e6", "2.002e6"))
    assert cli.main(["check", str(plate)]) == 1
    seen = capsys.readouterr()
    assert "moved" in seen.out
    assert "the gate refuses 1 rows" in seen.err
    assert "mesh 2x2" in seen.err
    assert cli.main(["accept", str(plate), "--reason", "stiffer on purpose"]) == 0
    assert cli.main(["check", str(plate)]) == 0
    stored = gate.read(Path("baselines/plate.json"))
    assert [entry["reason"] for entry in stored["accepts"]] == ["first", "stiffer on purpose"]


def test_accept_without_a_reason_is_wrong_usage_where_nobody_can_be_asked(plate, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    assert cli.main(["accept", str(plate)]) == 2
    assert "--reason" in capsys.readouterr().err
    assert cli.main(["accept", str(plate), "--reason", " "]) == 2
    assert not Path("baselines").exists()


def test_accept_asks_on_a_terminal(plate, monkeypatch):
    terminal = io.StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr(sys, "stdin", terminal)
    monkeypatch.setattr("builtins.input", lambda prompt: "asked and told")
    assert cli.main(["accept", str(plate)]) == 0
    assert gate.read(Path("baselines/plate.json"))["accepts"][0]["reason"] == "asked and told"


def test_companions_are_paths_beside_the_scene_or_shipped_names(plate, capsys):
    (plate.parent / "folder").mkdir()
    plate = plate.replace(plate.parent / "folder" / "plate.toml")
    other = plate.parent / "other.toml"
    other.write_text(plate.read_text().replace('"plate"', '"other"').replace("0.05", "0.04"))
    plate.write_text(SCENE.format(companions='"other.toml"'))
    assert [scene.name for scene in cli.with_companions(str(plate))] == ["plate", "other"]
    plate.write_text(SCENE.format(companions='"cantilever_plain"'))
    assert [scene.name for scene in cli.with_companions(str(plate))] == ["plate", "cantilever_plain"]
    plate.write_text(SCENE.format(companions='"missing.toml"'))
    assert cli.main(["check", str(plate)]) == 2
    assert "missing.toml" in capsys.readouterr().err


@pytest.mark.parametrize("companions", ['"other.toml"', '"third.toml", "other.toml"', '"other.toml", "other.toml"'])
def test_scenes_that_run_together_need_names_of_their_own(plate, capsys, companions):
    """Another thickness under the name of the scene, or of another companion; both files are named."""
    named = "plate" if companions == '"other.toml"' else "other"
    for name in ("other", "third"):
        text = SCENE.format(companions="").replace('"plate"', f'"{named}"').replace("0.05", "0.04")
        (plate.parent / f"{name}.toml").write_text(text)
    plate.write_text(SCENE.format(companions=companions))
    assert cli.main(["table", str(plate)]) == 2
    said = capsys.readouterr().err
    first = plate.parent / companions.partition(",")[0].strip('"') if named == "other" else plate
    assert f"other.toml: name = '{named}': that of {first}, which runs with it" in said
    assert not Path("reports").exists()


def test_set_changes_the_physics_and_leaves_companions_and_paper_out():
    stated = cli.with_companions("cantilever")
    (scene,) = cli._changed(stated, ["grooves.0.depth=0.02", "title=A plate"])
    assert (scene.name, scene.grooves[0].depth, scene.title) == ("cantilever_set", 0.02, "A plate")
    assert (scene.published, scene.companions, scene.sensitivity, scene.study) == (None, (), None, "scene")
    (scene,) = cli._changed(stated, ["grooves=[]"])
    assert scene.grooves == ()


def test_set_of_anything_but_physics_keeps_the_study():
    stated = cli.with_companions("cantilever")
    changed = cli._changed(stated, ['ancf.levels=[{ mesh = [2, 2], time_step = 0.02, budget = "quick" }]'])
    assert [scene.name for scene in changed] == [scene.name for scene in stated]
    assert len(changed[0].ancf.levels) == 1
    assert changed[0].published == stated[0].published


def test_every_command_on_one_scene_takes_the_same_change(plate, capsys, monkeypatch):
    """What run has solved is reused by table and export, so that the three mean one scene."""
    monkeypatch.setattr(export, "write", lambda result, path: path.write_text(result.scene["name"]))
    change = [str(plate), "--set", "material.youngs_modulus=4.0e6"]
    assert cli.main(["run", *change]) == 0
    capsys.readouterr()
    assert cli.main(["table", *change, "--format", "json"]) == 0
    seen = capsys.readouterr()
    assert [row["value"] for row in json.loads(seen.out)] == pytest.approx([-0.505, -0.50444444])
    assert "0 units solved, 2 reused" in seen.err
    kept = sorted(Path("reports/build/results").iterdir())
    assert cli.main(["export", str(plate), "bent.vtu", *change[1:]]) == 0
    assert Path("bent.vtu").read_text() == "plate_set" and sorted(Path("reports/build/results").iterdir()) == kept
    assert cli.main(["explain", *change]) == 0
    assert "material: St. Venant-Kirchhoff, E 4e+06 Pa" in capsys.readouterr().out


WRONG = {
    "unknown scene": (["run", "nope"], "nope: no such scene"),
    "unknown command": (["jump"], "invalid choice"),
    "no command": ([], "required"),
    "unknown budget": (["run", "cantilever", "--budget", "huge"], "invalid choice"),
    "no jobs": (["run", "cantilever", "--jobs", "0"], "not a positive number"),
    "set without value": (["run", "cantilever", "--set", "thickness"], "write KEY=VALUE"),
    "set of an unknown key": (["run", "cantilever", "--set", "colour=3"], "colour"),
    "set to a wrong value": (["run", "cantilever", "--set", "thickness=-1"], "thickness"),
    "no level to run": (["run", "plate.toml", "--solver", "reference"], "no level"),
}


@pytest.mark.parametrize(("arguments", "reason"), WRONG.values(), ids=WRONG)
def test_wrong_usage_exits_2_with_one_message_and_computes_nothing(plate, capsys, arguments, reason):
    try:
        code = cli.main(arguments)
    except SystemExit as end:
        code = end.code
    seen = capsys.readouterr()
    assert code == 2
    assert seen.out == ""
    assert reason in seen.err
    assert not Path("reports").exists()


def test_explain_says_what_is_modelled_left_out_and_what_it_costs(plate, capsys):
    assert cli.main(["explain", str(plate)]) == 0
    seen = capsys.readouterr().out
    for text in ("modelled: all", "left out: none", "2x2", "48 unknowns", "1 MB", "[quick]", "[standard]"):
        assert text in seen
    assert "load: point, (0, 0, -50) N at (1, 1), constant" in seen
    assert "plate: rectangle, x 0 to 1 and y 0 to 1 m, 0.05 m thick" in seen


def test_explain_marks_what_the_machine_does_not_hold(plate, capsys, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", f"huge {1 / 3:g}")
    assert cli.main(["explain", str(plate)]) == 0
    fits, huge = [line for line in capsys.readouterr().out.splitlines() if "unknowns " in line]
    assert "MB of this machine" not in fits and huge.endswith(" MB of this machine; refused without --any-size")
    monkeypatch.setattr(pool, "physical_mb", lambda: 0.7)
    assert cli.main(["explain", str(plate), "--budget", "quick"]) == 0
    assert capsys.readouterr().out.endswith("  more than the 1 MB of this machine\n")


def test_numbers_of_explain_are_apart_however_large():
    stated = {"elements": 3134918128, "unknowns": 13793639763, "memory_mb": 326612357.0}
    assert _cost(stated) == "3134918128 elements  13793639763 unknowns  326612357 MB"


def test_a_level_beyond_the_memory_exits_1_and_any_size_solves_it(plate, capsys, monkeypatch):
    monkeypatch.setenv("FAKE_SOLVER", f"huge {1 / 3:g}")
    assert cli.main(["run", str(plate)]) == 1
    seen = capsys.readouterr().err
    assert "[1/2] plate: ancf 3x3, 7x7x3 points too_large: needs about 1,000 GiB of memory" in seen
    assert "1 units solved, 0 reused" in seen and "GiB; a coarser level needs less" in seen
    assert cli.main(["run", str(plate), "--any-size"]) == 0


def test_a_thickness_beyond_a_plates_is_told_and_solved(plate, capsys):
    """Millimetres for metres, by the plate's key; the answer goes where it went."""
    told = "thickness = 10: above 0.5 of the shorter side, 1 m; lengths are in metres"
    plate.write_text(plate.read_text().replace("thickness = 0.05", "thickness = 10.0"))
    assert cli.main(["explain", str(plate)]) == 0
    assert capsys.readouterr().out.endswith(f"\nwarning: {told}\n")
    assert cli.main(["run", str(plate), "--budget", "quick"]) == 0
    seen = capsys.readouterr()
    assert seen.err.count(f"warning: plate: {told}\n") == 1 and "warning" not in seen.out
    plate.write_text(plate.read_text().replace("thickness = 10.0", "thickness = 0.5"))
    assert cli.main(["table", str(plate)]) == 0
    assert "warning" not in capsys.readouterr().err


def test_scenes_lists_every_shipped_scene_with_its_title(capsys):
    assert cli.main(["scenes"]) == 0
    seen = capsys.readouterr().out
    assert "cantilever_plain" in seen
    assert "Table 5" in seen


HEAVY = ("numba", "gmsh", "vtk", "vtkmodules", "pyvista", "matplotlib", "skfem", "rich", "jinja2")


def command(*arguments):
    """Run the command in a process of its own; returns it, what it said, and the heavy modules it loaded."""
    script = (
        "import sys, atexit\n"
        f"atexit.register(lambda: print('LOADED', *[m for m in {HEAVY} if m in sys.modules], file=sys.stderr))\n"
        "from compare.cli import main\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True, timeout=60)
    *said, loaded = done.stderr.splitlines()
    return done, said, loaded.split()[1:]


def test_help_loads_not_even_numpy():
    script = (
        "import sys; from compare.cli import main\ntry: main(['--help'])\nfinally: assert 'numpy' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, timeout=60).returncode == 0


def test_help_loads_nothing_heavy_and_shows_examples_units_and_exit_codes():
    done, _, loaded = command("--help")
    assert done.returncode == 0
    assert loaded == []
    for text in ("examples:", "exit codes:", "metres", "groovecheck check cantilever"):
        assert text in done.stdout


def test_the_version_is_that_of_the_installed_package(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"groovecheck {version('groovecheck')}\n"


def test_a_refused_scene_loads_nothing_heavy_and_shows_no_traceback(tmp_path):
    path = tmp_path / "plate.toml"
    path.write_text(SCENE.format(companions="").replace("thickness = 0.05", "thickness = -0.05\ncolour = 3"))
    done, said, loaded = command("run", str(path))
    assert done.returncode == 2
    assert loaded == []
    assert "Traceback" not in done.stderr
    assert any("plate.toml" in line and "thickness = -0.05" in line for line in said)
    assert any("colour" in line and "unknown key" in line for line in said)


def test_the_installed_command_exists():
    name = Path(sys.executable).parent / "groovecheck"
    done = subprocess.run([name, "run", "nope"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert "no such scene" in done.stderr


def test_an_interrupt_exits_without_a_traceback_and_keeps_results(plate, tmp_path):
    script = (
        "import sys; sys.path.insert(0, sys.argv.pop(1))\n"
        "from compare import cli; cli.SOLVERS = {'ancf': 'fake_solver'}; sys.exit(cli.main())\n"
    )
    marker = tmp_path / "asleep"
    environment = {**os.environ, "FAKE_SOLVER": "sleep 0.5", "FAKE_SOLVER_ID": str(marker)}
    arguments = [sys.executable, "-c", script, str(Path(__file__).parent), "table", str(plate), "--jobs", "1"]
    with subprocess.Popen(arguments, env=environment, stderr=subprocess.PIPE, text=True) as process:
        limit = time.monotonic() + 30
        while not marker.exists() and time.monotonic() < limit:
            time.sleep(0.05)
        process.terminate()
        said = process.communicate(timeout=30)[1]
    assert process.returncode == 130
    assert "Traceback" not in said
    assert "interrupted" in said
    assert len(list(Path("reports/build/results").glob("*.npz"))) == 1


def test_an_edited_copy_of_a_shipped_scene_is_not_taken_for_it(plate, capsys):
    """Same name, other material: named after its file, without printed values; an unchanged copy stays what it is.

    The gate reads and writes one table for it, that of the file's name.
    """
    text = (SHIPPED / "cantilever.toml").read_text()
    plate.write_text(text)
    assert [scene.name for scene in cli.with_companions(str(plate))][:2] == ["cantilever", "cantilever_plain"]
    plate.write_text(text.replace("poissons_ratio = 0.0", "poissons_ratio = 0.3"))
    (found,) = cli.with_companions(str(plate))
    assert (found.name, found.study, found.published) == ("plate", "scene", None)
    assert found.material.poissons_ratio == 0.3
    assert "states another plate than the shipped cantilever" in capsys.readouterr().err
    assert cli.main(["accept", str(plate), "--reason", "mine"]) == 0
    assert [path.name for path in Path("baselines").iterdir()] == ["plate.json"]
    assert cli.main(["check", str(plate)]) == 0
    assert "plate: 8 rows pass the gate" in capsys.readouterr().out


def test_a_folder_that_cannot_be_written_is_wrong_usage(plate, capsys):
    Path("taken").write_text("a file")
    assert cli.main(["table", str(plate), "--out", "taken"]) == 2
    seen = capsys.readouterr()
    assert "--out taken: cannot be written" in seen.err
    assert seen.out == ""
