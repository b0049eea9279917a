"""Closed-form and published values: the third opinion, so that two solvers agreeing is not the only evidence.

Kinds: "exact" (a closed form evaluated here), "published" (printed in the cited source) and
"cross-code" (computed by a code nobody here wrote).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.scene import Scene


@dataclass(frozen=True)
class Value:
    """A number to be judged against: value and unit, kind, source, and the cell or model it came from.

    mesh: elements along x and y of the printed row, where it belongs to one.
    """

    name: str
    value: float
    unit: str
    kind: str
    source: str
    cell: str = ""
    mesh: tuple[int, int] | None = None


def published(scene: Scene) -> tuple[Value, ...]:
    """Printed heights (m) of the scene's answer probe: one per mesh, then the converged one."""
    stated = scene.published
    if stated is None:
        return ()
    rows = [Value("height", r.value, "m", "published", stated.source, r.cell, r.mesh) for r in stated.rows]
    if stated.converged is not None:
        rows.append(Value("height", stated.converged.value, "m", "published", stated.source, stated.converged.cell))
    return tuple(rows)
