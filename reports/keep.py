"""Measurements kept on disk: a unit of an exhibit whose inputs did not change is read, not measured again.

A unit's inputs are its name, its arguments, every source and scene of this project and the versions of the libraries.
So a study that was killed goes on where it was, and an edit anywhere measures everything again. Exhibits of times
(`reports.speed`) measure each time.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
from functools import cache
from pathlib import Path
from typing import Any

from compare.files import sweep, write_text
from compare.study import LIBRARIES, version
from reports.unit import Measured, measure

PACKAGES = ("ancf", "reference_fe", "compare", "reports")


def kept(folder: Path, name: str, arguments: dict[str, Any]) -> Measured:
    """The measurement of a unit, from folder/<key>.json where it is there; a crash is not kept."""
    path = folder / f"{key(name, arguments)}.json"
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        return Measured(name, arguments, held["status"], held["values"])
    except (OSError, ValueError, KeyError, TypeError):
        pass
    found = measure(name, **arguments)
    if not found.status.startswith(("failed", "absent")):
        write_text(path, json.dumps({"name": name, "status": found.status, "values": found.values}, indent=1) + "\n")
    return found


def key(name: str, arguments: dict[str, Any]) -> str:
    """Hash of all that a measurement depends on; 24 hexadecimal digits."""
    stated = json.dumps([name, arguments, sources()], sort_keys=True)
    return hashlib.sha256(stated.encode()).hexdigest()[:24]


@cache
def sources() -> str:
    """Hash of the project's sources and scenes and of the libraries' versions, as they were when it was first asked."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for folder in importlib.util.find_spec(package).submodule_search_locations:
            for path in sorted(p for suffix in ("py", "toml") for p in Path(folder).rglob(f"*.{suffix}")):
                digest.update(f"{package}/{path.relative_to(folder)}".encode() + b"\0" + path.read_bytes() + b"\0")
    for library in ("python", *dict.fromkeys(name for names in LIBRARIES.values() for name in names)):
        digest.update(f"{library} {version(library)}\0".encode())
    return digest.hexdigest()


def tidy(folder: Path) -> Path:
    """The folder, made where it is missing, without what killed processes left."""
    folder.mkdir(parents=True, exist_ok=True)
    sweep(folder)
    return folder
