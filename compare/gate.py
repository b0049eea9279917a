"""The gate: rows of a quick run against the accepted ones of reports/baselines/<scene>.json.

Only values are judged, heights and frequencies above all, never bitwise and never times. Two runs on the same platform
may differ by SAME (relative): they stop Newton at slightly different rounding, which the solver's tolerances hold
near 1e-9. Between platforms ACROSS is allowed: another BLAS, libm or sparse solver rounds
differently everywhere and another mesh generator may place a node elsewhere, while a wrong stiffness
of 0.1 % moves the plain cantilever by 2e-4 (2x2) to 4e-4 (4x4). A platform is operating system, machine type, Python
minor version and the versions of the libraries that compute; the processor model is left out,
because kernels chosen by it change rounding only.
"""

from __future__ import annotations

import json
import platform
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from compare.files import write_text

SCHEMA = 1
SAME = 1e-6
ACROSS = 1e-4
FLOOR = 1e-9  # m: a smaller accepted height is compared as if it were this large
CASE = "case"  # what a row is of that stands for no level of a scene; it then has a "unit" as well
IDENTITY = ("solver", "element", "rule", "groove", "load", "mode", "mesh")
LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "numba", "pymetis", "pypardiso", "mkl")

PARTS = {"platform": dict, "tolerance": dict, "rows": list, "accepts": list}  # of a baseline

Row = dict[str, Any]


class BaselineError(ValueError):
    """A baseline that is missing or cannot be read, or rows that cannot be accepted; the message says which."""


@dataclass(frozen=True)
class Margin:
    """One row against its accepted value.

    verdict: "ok", "moved", "failed" (no value now), "missing" (not computed now) or "new" (not accepted
    yet). change: |value - accepted| / |accepted|. used: change / tolerance, refused above 1.
    """

    row: str
    verdict: str
    value: float | None
    accepted: float | None
    change: float | None
    used: float | None
    status: str = "ok"
    unit: str = "m"

    @property
    def refused(self) -> bool:
        """Whether this row closes the gate."""
        return self.verdict in ("moved", "failed", "missing")


@dataclass(frozen=True)
class Verdict:
    """All margins and the tolerance they were judged by. same_platform: whether the baseline was made on this one."""

    margins: tuple[Margin, ...]
    tolerance: float
    same_platform: bool
    differs: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether no row is refused."""
        return not any(margin.refused for margin in self.margins)


def check(rows: list[Row], baseline: dict[str, Any], here: dict[str, Any] | None = None) -> Verdict:
    """Margins of the rows against a baseline, accepted rows first, then new ones. here: this platform."""
    here, there = here or platform_now(), baseline["platform"]
    differs = tuple(
        f"{name}: {there.get(name)} -> {here.get(name)}"
        for name in sorted({*here, *there})
        if here.get(name) != there.get(name)
    )
    tolerance = baseline["tolerance"]["across" if differs else "same"]
    accepted, now = named(baseline["rows"]), named(rows)
    margins = [_margin(name, row, now.get(name), tolerance) for name, row in accepted.items()]
    margins += [
        Margin(
            name,
            "new" if row["status"] == "ok" else "failed",
            row["value"],
            None,
            None,
            None,
            row["status"],
            _unit(row),
        )
        for name, row in now.items()
        if name not in accepted
    ]
    return Verdict(tuple(margins), tolerance, not differs, differs)


def _margin(name: str, accepted: Row, row: Row | None, tolerance: float) -> Margin:
    known, unit = accepted["value"], _unit(accepted)
    if row is None:
        return Margin(name, "missing", None, known, None, None, "not computed", unit)
    if row["status"] != "ok":
        return Margin(name, "failed", None, known, None, None, row["status"], unit)
    change = abs(row["value"] - known) / max(abs(known), FLOOR)
    used = change / tolerance
    verdict = "ok" if used <= 1 else "moved"  # nan is "moved"
    return Margin(name, verdict, row["value"], known, change, used, unit=unit)


def _unit(row: Row) -> str:
    return row.get("unit", "m" if row.get("mode") is None else "Hz")


def named(rows: list[Row]) -> dict[str, Row]:
    """Rows by their identity; rows of equal identity (other time steps, other scenes) are numbered in order."""
    found: dict[str, Row] = {}
    for row in rows:
        name = ", ".join(f"{key} {row[key]}" for key in (CASE, *IDENTITY) if row.get(key) is not None)
        count = sum(1 for other in found if other == name or other.startswith(f"{name} #"))
        found[name if not count else f"{name} #{count + 1}"] = row
    return found


def accept(rows: list[Row], reason: str, scene: str, path: Path) -> dict[str, Any]:
    """Write the rows as the scene's baseline, keeping the reasons of earlier ones; returns the baseline.

    Raises BaselineError where the reason is empty or a row failed.
    """
    if not reason.strip():
        raise BaselineError("a baseline needs a reason")
    failed = [name for name, row in named(rows).items() if row["status"] != "ok"]
    if failed or not rows:
        raise BaselineError("not accepted, these rows have no value: " + "; ".join(failed or ["all"]))
    accepts = read(path)["accepts"] if path.exists() else []
    entry = {"date": datetime.now(UTC).date().isoformat(), "reason": reason.strip(), "commit": commit(path.parent)}
    baseline = {
        "schema": SCHEMA,
        "scene": scene,
        "platform": platform_now(),
        "tolerance": {"same": SAME, "across": ACROSS},
        "rows": [{key: row[key] for key in (CASE, *IDENTITY, "value", "unit") if key in row} for row in rows],
        "accepts": [*accepts, entry],
    }
    write_text(path, json.dumps(baseline, indent=1, allow_nan=False) + "\n")
    return baseline


def read(path: Path) -> dict[str, Any]:
    """A baseline. Raises BaselineError where it is missing, damaged or of another schema."""
    try:
        baseline = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise BaselineError(f"{path}: no baseline yet; make one with groovecheck accept") from error
    except ValueError as error:
        raise BaselineError(f"{path}: not a baseline: {error}") from error
    if not isinstance(baseline, dict) or baseline.get("schema") != SCHEMA:
        raise BaselineError(f"{path}: not a baseline of schema {SCHEMA}")
    if wrong := list(_damaged(baseline)):
        raise BaselineError(f"{path}: missing or wrong in it: {', '.join(wrong)}; restore the file, or delete it")
    return baseline


def _damaged(baseline: dict[str, Any]) -> Iterator[str]:
    """Keys without which, or without numbers in which, nothing can be compared with a baseline."""
    whole = [key for key, kind in PARTS.items() if isinstance(baseline.get(key), kind)]
    yield from (key for key in PARTS if key not in whole)
    for key in ("same", "across") if "tolerance" in whole else ():
        if not isinstance(baseline["tolerance"].get(key), (int, float)):
            yield f"tolerance.{key}"
    for i, row in enumerate(baseline["rows"] if "rows" in whole else ()):
        if not isinstance(row, dict) or not isinstance(row.get("value"), (int, float)):
            yield f"rows.{i}.value"


def lines(verdict: Verdict) -> list[str]:
    """The verdict for people, one line per row, refused rows last."""
    found = []
    for margin in sorted(verdict.margins, key=lambda margin: margin.refused):
        value = "no value" if margin.value is None else f"{margin.value:.9f} {margin.unit}"
        accepted = "" if margin.accepted is None else f", accepted {margin.accepted:.9f} {margin.unit}"
        change = (
            "" if margin.change is None else f", change {margin.change:.2e} = {100 * margin.used:.3g} % of tolerance"
        )
        status = "" if margin.status == "ok" else f" ({margin.status})"
        found.append(f"{margin.verdict:8}{margin.row}: {value}{status}{accepted}{change}")
    where = (
        "same platform as the baseline" if verdict.same_platform else "other platform: " + "; ".join(verdict.differs)
    )
    return [*found, f"tolerance {verdict.tolerance:g} relative ({where})"]


def platform_now() -> dict[str, Any]:
    """What rounding may depend on here: system, machine, Python and the libraries' versions."""
    from compare.study import version

    python = ".".join(platform.python_version_tuple()[:2])
    about = {"system": platform.system(), "machine": platform.machine(), "python": python}
    return about | {name: version(name) for name in LIBRARIES}


def commit(folder: Path) -> str | None:
    """Short hash of the commit checked out around a folder, "-dirty" behind it with local changes; None without git."""
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=20).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None
