"""Studies of many units: what was measured outlives a kill, and a second run measures the rest."""

import importlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from reports import frame, keep
from reports.unit import Measured

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ["hard_cases", "integration", "plate_drop", "tire"])
def test_a_study_that_was_interrupted_goes_on_where_it_was(name, tmp_path, monkeypatch):
    """Interrupted in its fifth unit: the next run measures the rest, a third one nothing, one afresh everything."""
    study, made = importlib.import_module(f"reports.{name}.study"), []

    def measure(unit, **arguments):
        made.append((unit, arguments))
        if len(made) == 5:
            raise KeyboardInterrupt
        return Measured(unit, arguments, "no_value", {"number": len(made)})

    monkeypatch.setattr(keep, "measure", measure)
    monkeypatch.setattr(frame, "measure", measure)
    monkeypatch.setattr(keep, "sources", lambda: "one")
    chapters = [["paths"]] if name == "hard_cases" else []
    with pytest.raises(KeyboardInterrupt):
        study.run(*chapters, "quick", 1, take=frame.taking(tmp_path, fresh=False))
    kept = len(list((tmp_path / "results" / "units").glob("*.json")))
    assert kept >= 4 and len(made) <= kept + 2  # one was interrupted, one more may have been started meanwhile
    made.clear()
    made += [None] * 5  # interrupts no more
    study.run(*chapters, "quick", 1, take=frame.taking(tmp_path, fresh=False))
    total = len(list((tmp_path / "results" / "units").glob("*.json")))
    assert len(made) - 5 == total - kept > 0
    study.run(*chapters, "quick", 1, take=frame.taking(tmp_path, fresh=False))
    assert len(made) - 5 == total - kept
    study.run(*chapters, "quick", 1, take=frame.taking(tmp_path, fresh=True))
    assert len(made) - 5 >= total - kept + total


STUDY = """
import sys
from pathlib import Path
from reports import frame
from reports.hard_cases.chapter import Asked
told = [Asked("integration.runs.matrices", {"case": "Fig. 4", "subdomain": [n], "whole": [n]}) for n in range(2, 7)]
found = frame.outcomes([("all", unit) for unit in told], 1, frame.taking(Path(sys.argv[1]), fresh=False))
print([row[key] for outcome in found["all"] for row in outcome.measured.get("rows") for key in ("rule", "mass_error")])
"""


@pytest.mark.slow
def test_a_killed_study_loses_only_what_was_running(tmp_path):
    """SIGKILL when two units are kept: the rerun leaves them as they are, and finds what a run from nothing finds."""
    command, environment = [sys.executable, "-c", STUDY], {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([*command, str(tmp_path)], env=environment, stderr=subprocess.DEVNULL)
    folder, patience = tmp_path / "results" / "units", time.monotonic() + 120
    while len(list(folder.glob("*.json"))) < 2 and time.monotonic() < patience:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = {path: path.stat().st_mtime_ns for path in folder.glob("*.json")}
    assert 2 <= len(kept) < 5
    outs = (tmp_path, tmp_path / "other")
    runs = [subprocess.run([*command, str(out)], env=environment, capture_output=True, text=True) for out in outs]
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert runs[0].stdout == runs[1].stdout and "subdomain" in runs[0].stdout
