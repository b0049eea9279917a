"""What is wrong with a scene, in the words of its file: file, key, value, reason."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import ValidationError

SHOWN = 60
TAGS = {"rectangle", "nurbs", "revolved", "point", "edge", "patch", "gravity", "pressure", "moment", "at", "region"}
TAGS |= {"axle", "band", "outlined"}
TAGS |= {"clamp", "hold", "symmetry"}
TAGS |= {"dynamic", "static", "modes", "svk", "mooney-rivlin"}
LADDERS = {"ancf", "reference"}
REASONS = {
    "extra_forbidden": "unknown key",
    "missing": "this key is missing",
    "model_type": "needs a table of keys",
    "model_attributes_type": "needs a table of keys",
    "dict_type": "needs a table of keys",
    "tuple_type": "needs a list",
    "too_short": "needs at least one entry",
    "float_type": "needs a number",
    "int_type": "needs a whole number",
    "string_type": "needs a text",
    "finite_number": "needs a finite number",
}


class SceneError(ValueError):
    """A scene that cannot be computed; each problem names file, key, value and reason."""

    def __init__(self, problems: list[str]):
        super().__init__("\n".join(problems))
        self.problems = problems


def describe(error: ValidationError, data: dict[str, Any]) -> Iterator[str]:
    """Each pydantic error once, as "key = value: reason"; `data` is the file as it was read."""
    told = set()
    for detail in error.errors():
        if detail["type"] == "too_short" and detail["input"]:
            continue  # its entries are wrong, which is told for each of them
        line = _describe(detail, data)
        if line not in told:
            told.add(line)
            yield line


def _describe(detail: dict[str, Any], data: dict[str, Any]) -> str:
    keys, kind = _written(detail["loc"], data), detail["type"]
    context = detail.get("ctx", {})
    if kind == "union_tag_invalid":
        tag = context["discriminator"].strip("'")
        return f"{_dotted([*keys, tag])} = {context['tag']!r}: must be one of {context['expected_tags']}"
    if kind == "union_tag_not_found":
        return f"{_dotted([*keys, context['discriminator'].strip(chr(39))])}: this key is missing"
    if kind == "extra_forbidden" and tuple(detail["loc"][:2]) == ("analysis", "modes"):
        return f"{_dotted(keys)} = {_shown(detail['input'])}: modes have no time; state their count alone"
    reason = REASONS.get(kind, detail["msg"].removeprefix("Value error, ").replace("Input should be", "must be"))
    shown = "" if kind == "missing" else f" = {_shown(detail['input'])}"
    return f"{_dotted(keys)}{shown}: {reason}"


def _written(location: tuple[str | int, ...], data: dict[str, Any]) -> list[str | int]:
    """The keys as the user wrote them: without a union's tags, a ladder's default where it is stated."""
    keys = [key for i, key in enumerate(location) if not (key in TAGS and i in (1, 2) and i < len(location) - 1)]
    if len(keys) >= 4 and keys[0] in LADDERS and keys[1] == "levels":
        ladder = data[keys[0]]
        level = ladder["levels"][keys[2]]
        if isinstance(level, dict) and keys[3] not in level and keys[3] in ladder:
            return [keys[0], *keys[3:]]
    return keys


def _dotted(keys: list[str | int]) -> str:
    return ".".join(str(key) for key in keys) or "scene"


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 4]} ..."
