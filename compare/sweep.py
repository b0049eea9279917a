"""Many scenes at once: their units as one list, and what an engine needs to run them elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.scene import Scene
from compare.study import Unit, label

LEAST = 500  # MiB that a unit is granted at least: interpreter and libraries


def plan(asked: Sequence[tuple[str, list[Scene], list[Unit]]], estimates: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The plan as JSON values, for each (name or path, scene and companions, units): every unit once, and the pages."""
    units, pages = {}, []
    for path, scenes, own in asked:
        pages.append({"name": scenes[0].name, "scene": path, "keys": list(dict.fromkeys(unit.key for unit in own))})
        for unit in own:
            memory = estimates.get(unit.key, {}).get("memory_mb") or 0.0
            about = {"key": unit.key, "label": label(unit), "solver": unit.solver, "scene": path}
            units.setdefault(unit.key, {**about, "memory_mb": int(LEAST + memory)})
    return {"units": list(units.values()), "pages": pages}


def clashes(asked: Sequence[tuple[str, list[Scene], list[Unit]]]) -> list[str]:
    """Scenes of one name, which would write one page."""
    seen: dict[str, str] = {}
    found = []
    for path, scenes, _ in asked:
        if scenes[0].name in seen:
            found.append(f"{path}: its name {scenes[0].name!r} is that of {seen[scenes[0].name]}")
        seen.setdefault(scenes[0].name, path)
    return found
