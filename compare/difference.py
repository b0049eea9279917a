"""A Result against another Result, or against a known value: errors at the end and over the time history."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compare.result import OK, Result

if TYPE_CHECKING:
    from compare.exact import Value

CLOSE = 1e-9  # times that differ by less than this part of the duration are the same time
CLAMPS = ("gradients",)  # how a support is read, a choice of the solver and not part of the question


class DifferenceRefused(ValueError):
    """Two answers that cannot be compared; the message says why."""


@dataclass(frozen=True)
class Difference:
    """How far a result is from what it is judged against. Heights and errors in m.

    against: what; kind: "exact", "published", "cross-code" or "regression". height, height_against:
    z of the probe at the last common time; absolute: height - height_against, percent: of what
    height_against is from the probe's height at rest (None where that is zero). times (t,): the common
    times; error (t,): distance of the two positions; largest and rms of it, and rms_percent of the rms
    distance travelled by the probe.
    The history is None against a single value.
    """

    against: str
    kind: str
    probe: str
    height: float
    height_against: float
    absolute: float
    percent: float | None
    times: np.ndarray | None = None
    error: np.ndarray | None = None
    largest: float | None = None
    time_of_largest: float | None = None
    rms: float | None = None
    rms_percent: float | None = None


def between(result: Result, other: Result, probe: str | None = None, kind: str = "cross-code") -> Difference:
    """`result` against `other` at their common times; probe: its name, the first one by default.

    Raises DifferenceRefused where a result failed, the scenes are not the same question, a probe is
    missing, its reference position differs, or there is no common time after the start.
    """
    probe = probe or _first_probe(result)
    _comparable(result, other, probe)
    mine, theirs = common_times(result.times, other.times)
    if len(mine) == 0 or result.times[mine[-1]] <= 0:
        raise DifferenceRefused("no common time after the start")
    path, path_other = result.position(probe)[mine], other.position(probe)[theirs]
    times = result.times[mine]
    error = np.linalg.norm(path - path_other, axis=1)
    travelled = _rms(np.linalg.norm(path_other - other.probe_position[other.probes.index(probe)], axis=1))
    return Difference(
        f"{other.solver} {other.version} at h = {other.h:.4g} m, {other.unknowns} unknowns",
        kind,
        probe,
        *_heights(path[-1, 2], path_other[-1, 2], _rest(other, probe)),
        times,
        error,
        float(error.max()),
        float(times[error.argmax()]),
        _rms(error),
        100 * _rms(error) / travelled if travelled else None,
    )


def from_value(result: Result, value: Value, probe: str | None = None) -> Difference:
    """The probe's height at the last output time against a known height (m). Raises DifferenceRefused."""
    probe = probe or _first_probe(result)
    _succeeded(result, probe)
    if value.unit != "m":
        raise DifferenceRefused(f"{value.name} is in {value.unit}, a height is in m")
    against = f"{value.source}, {value.cell}" if value.cell else value.source
    heights = _heights(result.position(probe)[-1, 2], value.value, _rest(result, probe))
    return Difference(against, value.kind, probe, *heights)


def common_times(times: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices into both (sorted) arrays of the times they share, up to CLOSE of the longer duration."""
    close = CLOSE * max(times.max(initial=0), others.max(initial=0))
    at = np.clip(np.searchsorted(others, times - close), 0, max(len(others) - 1, 0))
    shared = np.abs(others[at] - times) <= close if len(others) else np.zeros(len(times), bool)
    return np.flatnonzero(shared), at[shared]


def unlike(scene: dict, other: dict, prefix: str = "") -> list[str]:
    """Keys in which two questions differ; names of scenes and readings of a clamp do not count."""
    found = []
    for key in sorted({*scene, *other}):
        mine, theirs, path = scene.get(key), other.get(key), f"{prefix}{key}"
        if path == "name" or key in CLAMPS:
            continue
        if isinstance(mine, dict) and isinstance(theirs, dict):
            found += unlike(mine, theirs, f"{path}.")
        elif _is_parts(mine) and _is_parts(theirs) and len(mine) == len(theirs):
            for index, (a, b) in enumerate(zip(mine, theirs, strict=True)):
                found += unlike(a, b, f"{path}.{index}.")
        elif mine != theirs:
            found.append(path)
    return found


def _is_parts(value: object) -> bool:
    return isinstance(value, (list, tuple)) and bool(value) and all(isinstance(part, dict) for part in value)


def _first_probe(result: Result) -> str:
    if not result.probes:
        raise DifferenceRefused(f"{result.solver} found no heights: the scene has no probe")
    return result.probes[0]


def _comparable(result: Result, other: Result, probe: str) -> None:
    for one in (result, other):
        _succeeded(one, probe)
    if differing := unlike(result.scene, other.scene):
        raise DifferenceRefused(f"not the same question, they differ in {', '.join(differing)}")
    here, there = (one.probe_position[one.probes.index(probe)] for one in (result, other))
    # a patch's mean reference position is integrated by each solver, so it agrees to rounding of volumes only
    if np.abs(here - there).max() > 1e-6 * max(1.0, np.abs(here).max()):
        raise DifferenceRefused(
            f"probe {probe} starts at {here.tolist()} in one result and {there.tolist()} in the other"
        )


def _succeeded(result: Result, probe: str) -> None:
    if result.status != OK:
        raise DifferenceRefused(
            f"{result.solver} at h = {result.h:.4g} failed: {result.status} {result.message}".strip()
        )
    if probe not in result.probes:
        raise DifferenceRefused(f"{result.solver} has no probe {probe}, it has {', '.join(result.probes)}")


def _rest(result: Result, probe: str) -> float:
    """Height (m) of a probe at rest."""
    return float(result.probe_position[result.probes.index(probe), 2])


def _heights(height: float, against: float, rest: float) -> tuple[float, float, float, float | None]:
    """(height, height_against, absolute, percent)."""
    absolute, moved = float(height - against), float(against - rest)
    return float(height), float(against), absolute, 100 * absolute / moved if moved else None


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
