"""What a scene may not say although each key alone is well formed: geometry, material, times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterator

if TYPE_CHECKING:
    from compare.scene import Scene


def problems(scene: Scene) -> Iterator[str]:
    """Problems of the scene, each as "key = value: reason"."""
    yield from ()
