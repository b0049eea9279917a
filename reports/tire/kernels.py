"""What the force and the tangent of the tire's rubber elements cost, and where that time goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from compare.report import Column, Table, Text
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import Asked, Outcome
from reports.speed_profile import replaced
from reports.timing import least
from reports.tire.scenes import tire

RUN = "tire.kernels"
MESH = [12, 5]  # of the quarter: 24 x 10 elements of the whole tire
BARS = {"force_us": 10.0, "tangent_us": 60.0}
PARTS = {  # of a tangent, by what computes them; what is left are matrix products
    "law": (("rubber", "add_cauchy_green"), ("moduli", "elasticity")),
    "thickness": (("relaxation", "relax"), ("relaxation", "add_low_rank")),
}
REPEATS = 7


def units() -> list[Asked]:
    """What is run."""
    return [Asked(f"{RUN}.{name}", {"mesh": MESH}) for name in ("rubber", "split")]


def rubber(mesh: list[int], **told: Any) -> dict[str, Any]:
    """Microseconds per element of force and tangent with the tread's grooves and without, the least of five."""
    count, groups, Q = _strained(mesh, told)
    force, tangent = seconds(groups, Q)
    plain_count, *plain = _strained(mesh, told, grooves=[])
    plain_force, plain_tangent = seconds(*plain)
    return {
        "elements": count,
        "points_per_element": sum(len(form.volume) for group in groups for form in _forms(group)) / count,
        "force_us": 1e6 * force / count,
        "tangent_us": 1e6 * tangent / count,
        "force_us_plain": 1e6 * plain_force / plain_count,
        "tangent_us_plain": 1e6 * plain_tangent / plain_count,
    }


def split(mesh: list[int], **told: Any) -> dict[str, Any]:
    """Microseconds per element of the parts of a tangent, by group of elements with equally many functions, and of
    the products alone: as many operations of the same shapes, at the speed of this machine's BLAS."""
    _, groups, Q = _strained(mesh, told)
    return {"rows": [_row(group, own) for group, own in zip(groups, Q, strict=True)]}


def _row(group, Q: np.ndarray) -> dict[str, Any]:
    count, points = len(group.form_of), float(np.mean([len(form.volume) for form in _forms(group)]))
    best: dict[str, float] = {}
    with _clocked() as spent:
        for _ in range(REPEATS):
            spent.clear()
            begin = time.process_time()
            for _ in group.tangent(Q):
                pass
            whole = time.process_time() - begin
            if not best or whole < best["whole"]:
                best = {**dict.fromkeys(PARTS, 0.0), **spent, "whole": whole}
    best["products"] = best["whole"] - sum(best[part] for part in PARTS)
    blas, operations = _products(group)
    own = {"elements": count, "functions": Q.shape[1], "points": points, "operations": operations / count}
    return own | {part: 1e6 * best[part] / count for part in best} | {"blas": 1e6 * blas / count}


def _products(group) -> tuple[float, float]:
    """Least seconds that BLAS takes for the products of all elements' moduli, and their operations."""
    calls, operations = [], 0.0
    for form, number in zip(*np.unique(group.form_of, return_counts=True), strict=True):
        for rows, table in group.forms[form].products.parts:
            calls.append((np.ones((rows * number, len(table))), table))
            operations += 2.0 * rows * number * table.size
    return least(lambda: [part @ table for part, table in calls], REPEATS), operations


@contextmanager
def _clocked() -> Iterator[dict[str, float]]:
    """CPU seconds by part of what computes tangents inside."""
    from ancf import moduli, relaxation, rubber

    modules, spent = {"rubber": rubber, "moduli": moduli, "relaxation": relaxation}, {}

    def timed(part: str, function: Callable) -> Callable:
        def call(*arguments):
            begin = time.process_time()
            found = function(*arguments)
            spent[part] = spent.get(part, 0.0) + time.process_time() - begin
            return found

        return call

    places = [(part, modules[module], name) for part, own in PARTS.items() for module, name in own]
    with replaced({(module, name): timed(part, getattr(module, name)) for part, module, name in places}):
        yield spent


def _strained(mesh: list[int], told: dict[str, Any], **more: Any) -> tuple[int, tuple, list[np.ndarray]]:
    """Number of elements, their groups of equally many functions, and nodal vectors of each, slightly strained."""
    from ancf.unpack import build

    scene, level = tire({"mesh": mesh, **told}, **more)
    model = build(scene, level)
    q = model.mesh.vectors.ravel() * (1 + 1e-3 * np.sin(np.arange(model.mesh.vectors.size)))
    elements, Q = model.body.elements, model.system.assembly.gather(q)
    return len(model.mesh.connectivity), *grouped(elements, Q)


def grouped(elements, Q) -> tuple[tuple, list[np.ndarray]]:
    """Groups of elements with equally many functions, and the nodal vectors of each."""
    return (elements.groups, Q) if hasattr(elements, "groups") else ((elements,), [Q])


def seconds(groups, Q) -> tuple[float, float]:
    """CPU seconds of a force and of a tangent of all elements, whose groups give theirs span by span."""
    pairs = list(zip(groups, Q, strict=True))
    force = least(lambda: [group.force(own) for group, own in pairs])
    return force, least(lambda: [list(group.tangent(own)) for group, own in pairs])


def _forms(group) -> list:
    group = getattr(group, "isochoric", group)
    return [group.forms[form] for form in group.form_of]


def figures(outcomes: list[Outcome]) -> list[Figure]:
    """Force and tangent per element."""
    outcome, made = outcomes[0], []
    for name, bar in BARS.items():
        value, note = outcome.get(name), ""
        if outcome.ok:
            plain, points = outcome.get(f"{name}_plain"), outcome.get("points_per_element")
            note = f"{points:.0f} points in a mean element of the grooved tire; without grooves {plain:.1f} µs."
        label = f"Mooney-Rivlin {name.removesuffix('_us')}, microseconds per enriched element"
        made.append(at_most(name, label, value, "µs", bar, against="one thread, the least of 5", note=note))
    return made


ROWS = (
    Column("elements", "elements", "d"),
    Column("functions", "functions", "d"),
    Column("points", "points", ".0f"),
    Column("law", "law and moduli", ".1f", "µs"),
    Column("thickness", "free thickness strain", ".1f", "µs"),
    Column("products", "products and gathering", ".1f", "µs"),
    Column("blas", "those products alone", ".1f", "µs"),
    Column("whole", "tangent", ".1f", "µs"),
    Column("operations", "operations of the products", ",.0f"),
)


def blocks(outcomes: list[Outcome]) -> list:
    """Where the time of a tangent goes."""
    words = [
        "A tangent sums the moduli of the law over the points of each column through the thickness, and then, over all "
        "columns, their products with the gradients of every pair of functions, nine by nine. Elements with kinks at "
        "grooves have more functions and, groove by groove, more points; the law grows with the points, the products "
        "with the columns times the square of the functions. The paper's element has 16 functions, and 32 points of a "
        "4 x 4 x 2 rule without grooves: its cost is on the page about speed. What the products alone take is measured "
        "beside the tangent, as matrix products of the same shapes.",
    ]
    rows = [row for o in outcomes if o.ok for row in o.get("rows") or ()]
    if rows:
        count = sum(row["elements"] for row in rows)
        mean = {part: sum(row["elements"] * row[part] for row in rows) / count for part in ("whole", "law", "blas")}
        words.append(
            f"In the mean the law and its moduli take {mean['law']:.0f} and the products alone {mean['blas']:.0f} of "
            f"{mean['whole']:.0f} µs. No order of calls of this form comes below the two."
        )
    return [Text(words), Table("Microseconds per element of a tangent, one thread.", ROWS, rows)]
