"""Killed, crowded and misused: nothing done is lost, nothing half-written is read, nothing is written elsewhere."""

import json
import multiprocessing
import os
import pickle
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import fake_solver
import numpy as np
import pytest
from fake_solver import small

from compare import files, history, index, report, trend
from compare.result import ResultError, load, save

HERE = Path(__file__).parent
RUN = """
import sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
from compare import study
from compare.scene import load
level = {"element": "conforming", "points": [3, 3, 2], "time_step": 0.02, "budget": "quick"}
scene = load("cantilever_plain").override({
    "ancf": {"levels": [{**level, "mesh": [n, n]} for n in (2, 3, 4)]}, "reference": None, "sensitivity": None})
study.run([scene], {"ancf": "ancf.run"}, "quick", Path(sys.argv[2]), jobs=2)
"""


def begin(folder):
    """A cheap run of three real units in a session of its own."""
    return subprocess.Popen([sys.executable, "-c", RUN, str(HERE), str(folder)], start_new_session=True)


def answers(folder):
    """Everything but times of every result, by key."""
    found = {}
    for path in folder.glob("*.npz"):
        result = load(path)
        found[path.stem] = (result.status, result.unknowns, result.displacement.tobytes(), result.times.tobytes())
    return found


@pytest.mark.slow
def test_a_run_killed_at_twenty_random_moments_ends_as_if_it_had_not_been(tmp_path):
    """SIGKILL to the run (its workers lose their pipe) and then again, undisturbed: the same bits each time.

    No result is half-written at the kill, and the second run takes over those that were finished.
    """
    began = time.monotonic()
    assert begin(tmp_path / "undisturbed").wait() == 0
    length, moments = time.monotonic() - began, random.Random(7)
    undisturbed, kept = answers(tmp_path / "undisturbed"), []
    assert len(undisturbed) == 3
    for count in range(20):
        folder = tmp_path / str(count)
        folder.mkdir()
        run = begin(folder)
        time.sleep(moments.uniform(0, length))
        os.kill(run.pid, signal.SIGKILL)
        run.wait()
        finished = {path: path.stat().st_mtime_ns for path in folder.glob("*.npz")}
        assert answers(folder).items() <= undisturbed.items()
        assert begin(folder).wait() == 0
        assert answers(folder) == undisturbed
        assert len(finished) < 3 or all(path.stat().st_mtime_ns == time for path, time in finished.items())
        kept.append(len(finished))
    assert len(set(kept)) > 1, "every kill fell into the same part of the run"


def limited(folder, *words):
    """The command in a process that may write no file above 12 kB, as a full disk would; (exit status, errors)."""
    script = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, 12_000))\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "from compare import cli; cli.SOLVERS = {'ancf': 'fake_solver'}\n"
        "sys.exit(cli.main(sys.argv[2:]))\n"
    )
    command = [sys.executable, "-c", script, str(HERE), *words]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=folder)
    return run.returncode, run.stderr


@pytest.mark.slow
def test_a_full_disk_is_a_message_and_what_was_finished_stays(tmp_path):
    """Exit status 3 and one line; the results are there, a page that was not written whole is not."""
    words = (
        "run",
        "cantilever_plain_patch",
        "--solver",
        "ancf",
        "--budget",
        "quick",
        "--out",
        "out",
        "--set",
        "study=scene",
    )
    status, said = limited(tmp_path, *words)
    assert status == 3 and "File too large" in said and "Traceback" not in said
    assert len(answers(tmp_path / "out" / "results")) > 0
    assert not list((tmp_path / "out").glob("*.html")) and not list((tmp_path / "out").rglob("*.part"))


def test_two_runs_at_once_in_one_folder_agree(tmp_path):
    """Both end well, with the results of one of them in the folder."""
    script = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path; from compare import study; from fake_solver import FAKE, small\n"
        "found = study.run([small((2, 3))], FAKE, 'quick', Path(sys.argv[2]))\n"
        "sys.exit(not all(entry.ok for entry in found))\n"
    )
    runs = [subprocess.Popen([sys.executable, "-c", script, str(HERE), str(tmp_path)]) for _ in range(2)]
    assert [run.wait(timeout=60) for run in runs] == [0, 0]
    assert len(list(tmp_path.iterdir())) == 2 == len(answers(tmp_path))


def append_many(folder, worker):
    for count in range(50):
        history.append(folder, {"study": "s", "budget": None, "figures": {str(worker): {"value": count}}})


def test_a_history_written_by_two_runs_at_once_keeps_every_line(tmp_path, monkeypatch):
    monkeypatch.setattr(history, "KEPT", 1000)
    runs = [multiprocessing.get_context("fork").Process(target=append_many, args=(tmp_path, n)) for n in range(2)]
    for run in runs:
        run.start()
    for run in runs:
        run.join()
    assert len(history.read(tmp_path, "s")) == 100


def test_a_line_of_history_that_was_cut_off_harms_neither_its_neighbours_nor_the_next(tmp_path):
    good = {"study": "s", "budget": None, "figures": {}}
    history.append(tmp_path, good)
    with (tmp_path / history.FILE).open("a") as file:
        file.write('{"study": "s", "figu')
    history.append(tmp_path, good)
    assert history.read(tmp_path, "s") == [good, good]


@pytest.mark.parametrize("fails", ["write", "replace"])
def test_a_write_that_fails_leaves_the_old_file_and_no_rest(tmp_path, monkeypatch, fails):
    path = tmp_path / "page.html"
    files.write_text(path, "old")
    if fails == "replace":
        monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    else:
        monkeypatch.setattr(os, "fchmod", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space left"):
        files.write_text(path, "new")
    assert path.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["page.html"]


def test_what_a_killed_process_left_is_removed_a_day_later(tmp_path):
    old, new = tmp_path / "a.part", tmp_path / "b.part"
    for path in (old, new):
        path.write_bytes(b"half")
    os.utime(old, (time.time() - 2 * files.STALE,) * 2)
    assert files.sweep(tmp_path) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["b.part"]


class Trap:
    """Unpickling it would write a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path.write_text, (self.path, "gotcha"))


def test_a_result_is_never_unpickled(tmp_path):
    """An array of objects is refused before any of it is made, and so is a pickle under the name of a result."""
    trap, bad = tmp_path / "trap", tmp_path / "bad.npz"
    made = fake_solver.solve(small(), small().ancf.levels[0])
    save(made, bad)
    with np.load(bad) as file:
        arrays = {name: file[name] for name in file.files}
    with bad.open("wb") as file:
        np.savez(file, **{**arrays, "times": np.array([Trap(trap)], dtype=object)})
    with pytest.raises(ResultError, match="not a result file"):
        load(bad)
    bad.write_bytes(pickle.dumps(Trap(trap)))
    with pytest.raises(ResultError, match="not a result file"):
        load(bad)
    assert not trap.exists()


def test_a_newer_result_is_refused_politely(tmp_path):
    path = tmp_path / "new.npz"
    save(fake_solver.solve(small(), small().ancf.levels[0]), path)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    header = {**json.loads(str(arrays["header"])), "schema": 99, "unheard of": 1}
    with path.open("wb") as file:
        np.savez(file, **{**arrays, "header": np.array(json.dumps(header))})
    with pytest.raises(ResultError, match="schema 99, this version reads"):
        load(path)


def test_the_index_names_what_it_cannot_read_and_shows_the_rest(tmp_path):
    """A hostile file name stays text, and a broken JSON takes no page down."""
    figures = {"a": {"value": 1.0, "unit": "%", "bar": 2.0, "met": True}}
    report.write(tmp_path, "good", report.Page("Good <b>", "x", []), {"figures": figures, "provenance": {}})
    (tmp_path / '"><script>alert(1)<.json').write_text("{}")
    (tmp_path / "list.json").write_text("[1]")
    page = report.render(index.page(tmp_path))
    assert "Good &lt;b&gt;" in page and page.count("<script") == 1
    assert page.count("is no page&#39;s JSON") == 2
    assert '<data value="50.0">' in page  # 1 of 2


@pytest.mark.parametrize(
    ("met", "word"), [((True, True), "met"), ((True, None), "not all run"), ((None, False), "missed"), ((), "stated")]
)
def test_a_figure_that_was_not_run_lets_no_study_be_met(tmp_path, met, word):
    figures = {str(i): {"value": None, "unit": "", "bar": 1.0, "met": one} for i, one in enumerate(met)}
    figures["told"] = {"value": 1.0, "unit": "s", "bar": None, "met": None}
    report.write(tmp_path, "study", report.Page("Study", "x", []), {"figures": figures, "provenance": {}})
    (row,) = index.page(tmp_path).sections[0].blocks[1].rows
    assert row["verdict"] == word and row["judged"] == f"{sum(one is True for one in met)} of {len(met)}"
    (record,) = history.read(tmp_path, "study")
    assert trend.section([record]).blocks[-1].rows[0]["met"] == row["judged"]


def test_the_index_tells_studies_of_one_title_apart_and_hides_no_failed_run(tmp_path):
    """The modes of one run are rows of their own, but one run."""
    failed = {"mode": None, "status": "newton_diverged"}
    rows = [{"mode": mode, "status": "ok"} for mode in (None, 1, 2, 3)]
    studies = {"good": (rows, []), "odd": ([*rows, failed], []), "varied": (rows, [failed]), "old": (None, None)}
    for name, (own, varied) in studies.items():
        content = {"figures": {}, "provenance": {}, "rows": own, "sensitivity": varied}
        report.write(tmp_path, name, report.Page("A plate", "x", []), content)
    words, table = index.page(tmp_path).sections[0].blocks
    assert {row["study"]: row["verdict"] for row in table.rows} == {
        **{"good": "stated", "odd": "2 of 3 runs succeeded"},
        **{"varied": "2 of 3 runs succeeded", "old": "stated"},
    }
    assert words.paragraphs[0].endswith(" Runs failed in 2.")
    assert ">varied<" in report.render(index.page(tmp_path))


@pytest.mark.parametrize("name", ["../outside", "/tmp/outside", "a/b", "..", "", "x\ny", ".hidden"])
def test_a_scene_writes_outside_no_folder(name):
    """Its name is the name of files."""
    from compare.scene import SceneError

    with pytest.raises(SceneError, match="name"):
        small(name=name)


@pytest.mark.parametrize("study_name", ["os.path", "../x", ""])
def test_a_scene_names_no_module_but_an_exhibit(study_name):
    from compare.scene import SceneError

    with pytest.raises(SceneError, match="study"):
        small(study=study_name)
