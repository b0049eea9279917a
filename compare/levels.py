"""Levels by name: how those of one solver's ladders are told apart, and found again."""

from __future__ import annotations

from collections.abc import Sequence

from compare.scene import Level
from compare.study import level_name
from compare.table import element, fineness, rule

STATED = {"points", "element", "fit", "enrich", "walls", "lips", "volumetric"}  # by `element` and `rule`


def names(levels: Sequence[Level]) -> list[str]:
    """A name for each level: its mesh or size, and where others share that, what tells it from them."""
    return [_name(level, [other for other in levels if level_name(other) == level_name(level)]) for level in levels]


def full_name(level: Level) -> str:
    """Mesh, element and points of a level, for example "8x8 conforming, 7x7x3 points"; of the reference its size."""
    points = rule(level)
    return f"{level_name(level)} {element(level)}, {points} points" if points else level_name(level)


def finest(levels: Sequence[Level]) -> Level:
    """The finest level with the element and rule of the first ladder, which pages draw boldest; of several time steps
    there the smallest."""
    first = element(levels[0]), rule(levels[0])
    own = (level for level in levels if (element(level), rule(level)) == first)
    return max(own, key=lambda level: (fineness(level), -(level.time_step or 0.0)))


def find(name: str, levels: Sequence[Level]) -> list[Level]:
    """The levels that a name may stand for: those of that very name, or else those that all its words are true of."""
    wanted = _words(name)
    exact = [level for level, known in zip(levels, names(levels), strict=True) if _words(known) == wanted]
    return exact or [level for level in levels if _is(level, wanted)]


def _is(level: Level, words: list[str]) -> bool:
    return words[:1] == [level_name(level)] and set(words) <= set(_words(" ".join((full_name(level), *_parts(level)))))


def _name(level: Level, alike: Sequence[Level]) -> str:
    """Name of a level beside those of the same mesh or size."""
    parts = zip(_parts(level), *map(_parts, alike), strict=True)
    return " ".join([level_name(level), *(own for own, *others in parts if set(others) != {own})])


def _parts(level: Level) -> tuple[str, ...]:
    """All that levels of one mesh or size may differ in."""
    rest = level.model_dump(mode="json", exclude={*STATED, "mesh", "size", "budget"})
    return (element(level), rule(level) or "", *(f"{key}={value}" for key, value in rest.items()))


def _words(name: str) -> list[str]:
    return name.replace(",", " ").split()
