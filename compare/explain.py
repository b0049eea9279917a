"""What a scene will cost and leave out, in words, before anything is solved."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.scene import Scene


def explain(scene: Scene, budget: str, solvers: dict[str, str]) -> list[str]:
    """Lines for people: the scene, its assumptions, and per solver what is modelled, left out, and each level's size.

    solvers: name in the scene -> dotted module with estimate(scene, level).
    """
    found = [scene.title, f"source: {scene.source or 'not stated'}"]
    found += [f"assumed: {text}" for text in scene.assumed]
    if scene.companions:
        found += [f"companions, run with it: {', '.join(scene.companions)}"]
    for solver, module in solvers.items():
        if levels := scene.ladder(solver, budget):
            found += ["", *_solver(scene, solver, levels, importlib.import_module(module))]
    return found


def _solver(scene: Scene, solver: str, levels: tuple, module: object) -> list[str]:
    from compare.study import level_name
    from compare.table import rule

    estimates = [module.estimate(scene, level) for level in levels]
    lines = [f"{solver}, budget of each level in brackets"]
    for key, shown in (("modelled", "modelled"), ("left_out", "left out")):
        lines += [f"  {shown}: {text}" for text in dict.fromkeys(text for stated in estimates for text in stated[key])]
    for level, stated in zip(levels, estimates, strict=True):
        points = f", {rule(level)} points" if rule(level) else ""
        lines.append(
            f"  {level_name(level):8}{stated['elements']:>8} elements{stated['unknowns']:>9} unknowns"
            f"{stated['memory_mb']:>8.0f} MB  step {level.time_step:g} s{points}  [{level.budget}]"
        )
    return lines
