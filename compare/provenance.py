"""Provenance: what made a page: versions, commit, machine, threads, date."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path

from compare.study import LIBRARIES, version


def provenance() -> dict[str, str | int | dict[str, str | None]]:
    """Facts about this run as plain JSON values; versions are null where a library is not installed."""
    libraries = ("python", "groovecheck", *dict.fromkeys(name for names in LIBRARIES.values() for name in names))
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "machine": f"{processor()} ({platform.machine()})",
        "system": f"{platform.system()} {platform.release()}",
        "cpu_count": os.cpu_count() or 0,
        "threads": "one per solver process, as many processes as the run was given",
        "versions": {name: version(name) for name in libraries},
    }


def commit() -> str:
    """Commit of the source, with "+ changes" where files differ from it; "unknown" outside a checkout."""
    here = Path(__file__).parent
    try:
        head = _git(here, "rev-parse", "--short=12", "HEAD")
        return head + (" + changes" if _git(here, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return "unknown"


def _git(folder: Path, *words: str) -> str:
    run = subprocess.run(["git", "-C", str(folder), *words], capture_output=True, text=True, check=True, timeout=20)
    return run.stdout.strip()


def processor() -> str:
    """Name of the processor as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or "unknown processor")
