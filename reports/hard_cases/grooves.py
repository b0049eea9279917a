"""Chapter: grooves. The table's deep ones with unknowns spent beside their edges, and extreme ones that must hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from compare.plots import Series, log_plot
from compare.report import Block, Column, Plots, Table, Text
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import Asked, Case, Chapter, Outcome, case_table

TITLE = "Deep, shallow and narrow grooves"
RUNS = "hard_cases.grooves_runs."
REMEDY = {"mesh": [6, 1], "element": "enriched", "fit": [0.8], "enrich": 0.95}
FINE = {"mesh": [6, 12], "element": "enriched", "fit": [0.2], "enrich": 0.95}
LADDER = (
    *({"mesh": [n, n], "element": "conforming"} for n in (10, 20)),
    *({"mesh": [n, n], "element": "enriched"} for n in (5, 10, 20)),
    {"mesh": [4, 1], "element": "enriched", "fit": [0.8]},
    {"mesh": [4, 1], "element": "enriched", "fit": [0.8], "enrich": 0.95},
    {"mesh": [5, 1], "element": "enriched", "fit": [0.8], "enrich": 0.9},
    REMEDY,
    {"mesh": [6, 1], "element": "enriched", "fit": [0.2, 0.8], "enrich": 0.95},
    FINE,
)
# (nu, analysis): {mesh size (m): (height (m), unknowns)} of the reference, recorded on 2026-11-24; a level again:
# python -m reports.unit hard_cases.grooves_runs.reference nu=0.0 mode=static size=0.1
REFERENCE: dict[tuple[float, str], dict[float, tuple[float, int]]] = {
    (0.0, "static"): {0.1: (-0.5986945, 11865), 0.05: (-0.6001062, 37746), 0.025: (-0.6007534, 170634)},
    (0.0, "dynamic"): {0.1: (-0.4753953, 11865), 0.05: (-0.4775714, 37746), 0.025: (-0.4784897, 170634)},
    (0.3, "static"): {0.1: (-0.5881200, 11865), 0.05: (-0.5905805, 37746), 0.025: (-0.5917428, 170634)},
    (0.49, "static"): {0.1: (-0.5533286, 11865), 0.05: (-0.5656312, 37746), 0.025: (-0.5700450, 170634)},
}
WIDTH, DEPTH, LINE, PLATE = 0.05, 0.03, 0.1, 0.05  # m: of a groove, its depth, a grid line, the thickness
FITTED = {"fit": [0.8], "enrich": 0.9}
EVEN = {"fit": None, "enrich": None}
NEAR = 1e-9  # m
NAMED = ("newton_diverged", "singular_tangent", "inverted_element")  # how a solve without an equilibrium may end
SAME_TO = 1e-4  # percent: the answer's change where an edge moves by NEAR, 1e-6 of it


def units(budget: str) -> list[Asked]:
    """What the budget pays for: quick about 15 s, standard about 100 s of CPU."""
    depths = (0.01, 0.95) if budget == "quick" else (0.01, 0.1, 0.3, 0.6, 0.9, 0.95)
    extremes = [_extreme(WIDTH, share * PLATE, LINE, spent) for share in depths for spent in (EVEN, FITTED)]
    extremes += [_extreme(WIDTH, DEPTH, LINE + move, EVEN) for move in (-NEAR, 0.0, NEAR)]
    if budget == "quick":
        return [_table(0.0, "dynamic", REMEDY), *extremes]
    extremes += [_extreme(WIDTH, DEPTH, LINE + move, FITTED) for move in (-NEAR, 0.0, NEAR)]
    extremes += [_extreme(width, DEPTH, 0.15, spent) for width in (1e-3, 5e-5, 1e-6) for spent in (EVEN, FITTED)]
    ladder = [_table(0.0, mode, level) for mode in ("static", "dynamic") for level in LADDER]
    asked = [*ladder, *(_table(nu, "static", level) for nu in (0.3, 0.49) for level in (REMEDY, FINE)), *extremes]
    if budget == "full":
        asked += [Asked(RUNS + "reference", {"nu": nu, "mode": mode, "size": 0.05}) for nu, mode in REFERENCE]
    return asked


def _table(nu: float, mode: str, level: dict[str, Any]) -> Asked:
    return Asked(RUNS + "table", {"nu": nu, "mode": mode, **level})


def _extreme(width: float, depth: float, at: float, spent: dict[str, Any]) -> Asked:
    return Asked(RUNS + "extreme", {"width": width, "depth": depth, "at": at, **spent})


def limit(nu: float, mode: str) -> float:
    """Height (m) to which the reference tends, by Richardson from three sizes that halve."""
    coarse, middle, fine = (REFERENCE[nu, mode][size][0] for size in (0.1, 0.05, 0.025))
    return fine + (fine - middle) / ((middle - coarse) / (fine - middle) - 1)


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """Cases, figures and blocks of what was run."""
    rows = [_row(outcome) for outcome in outcomes if outcome.asked.name == RUNS + "table"]
    extremes = [outcome for outcome in outcomes if outcome.asked.name == RUNS + "extreme"]
    cases = [*map(_accuracy, rows), *(case for outcome in extremes for case in _sound(outcome)), *_continuity(extremes)]
    return Chapter([case for case in cases if case is not None], _figures(rows), [*_blocks(rows, extremes)])


def _row(outcome: Outcome) -> dict[str, Any]:
    asked, height = outcome.asked.arguments, outcome.get("height")
    end = limit(asked["nu"], asked["mode"])
    error = None if height is None else 100 * (height - end) / abs(end)
    found = {name: outcome.get(name) for name in ("height", "unknowns", "cpu_seconds")}
    return {**asked, **found, "level": _words(asked), "error": error, "status": outcome.measured.status}


def _words(level: dict[str, Any]) -> str:
    words = [level.get("element", "enriched"), "{}x{}".format(*level.get("mesh", (4, 4)))]
    if level.get("fit") is not None:
        words.append("fitted " + " ".join(f"{distance:g}" for distance in level["fit"]))
    if level.get("enrich"):
        words.append(f"layers to {level['enrich']:g}")
    return ", ".join(words)


def _is(row: dict[str, Any], level: dict[str, Any]) -> bool:
    return all(row.get(key) == level.get(key) for key in ("mesh", "element", "fit", "enrich"))


def _accuracy(row: dict[str, Any]) -> Case | None:
    """The remedy on the table's grooves, against the limit of the reference."""
    if not (_is(row, REMEDY) or _is(row, FINE)):
        return None
    end, allowed = limit(row["nu"], row["mode"]), 1.0 if _is(row, REMEDY) else 0.5
    name = f"table's grooves, nu = {row['nu']:g}, {row['mode']}, {row['level']}"
    against = "cross-code: Richardson limit of the reference; what is asked of the error"
    return Case(name, "ancf", row["level"], row["height"], "m", end, allowed, against, row["status"])


def _sound(outcome: Outcome) -> Iterator[Case]:
    """Least eigenvalues and the stable time step are positive; the solve ends in equilibrium or a named status."""
    asked = outcome.asked.arguments
    name, level = _groove(asked), _words(asked)
    for key, words in (("least_mass", "least eigenvalue of the mass"), ("critical_step", "stable time step")):
        value = outcome.get(key)
        status = "ok" if value is not None and 0 < value < float("inf") else outcome.measured.status
        status = "not positive" if status == "ok" and not (value and value > 0) else status
        yield Case(f"{name}: {words}", "ancf", level, value, "s" if key == "critical_step" else "", status=status)
    status = outcome.measured.status
    yield Case(f"{name}: height", "ancf", level, outcome.get("height"), "m", status=status, may_fail=NAMED)


def _groove(asked: dict[str, Any]) -> str:
    spot = asked["at"] - LINE
    where = "" if spot == 0 or abs(spot) > 1e-6 else f", {spot:+.0e} m off a grid line"
    return f"groove {asked['width']:g} m wide, {100 * asked['depth'] / PLATE:g} % deep{where}"


def _continuity(outcomes: Sequence[Outcome]) -> Iterator[Case]:
    """An edge NEAR a grid line gives the answer of one on it."""
    on = {o.asked.arguments["fit"] is None: o for o in outcomes if _at(o, 0.0)}
    for outcome in outcomes:
        asked = outcome.asked.arguments
        true = on.get(asked["fit"] is None)
        if true is not None and any(_at(outcome, move) for move in (-NEAR, NEAR)):
            against = "exact: the groove on the line; 1e-6 of the height, as asked"
            yield Case(f"{_groove(asked)}: continuous", "ancf", _words(asked), outcome.get("height"), "m",
                       true.get("height"), SAME_TO, against, outcome.measured.status)  # fmt: skip


def _at(outcome: Outcome, move: float) -> bool:
    asked = outcome.asked.arguments
    return asked["width"] == WIDTH and asked["depth"] == DEPTH and asked["at"] == LINE + move


def _figures(rows: Sequence[dict[str, Any]]) -> list[Figure]:
    spent = [row for row in rows if _is(row, REMEDY)]
    plain = [row for row in spent if row["nu"] == 0]
    against = "Richardson limit of the reference on the patch-loaded twin"
    several = ", ".join(f"nu = {r['nu']:g} {r['mode']} {_percent(r)}{_of_unknowns(r)}" for r in spent)
    ratios, unknowns = [row for row in spent if row["nu"] > 0], [row["unknowns"] for row in spent]
    most = None if None in unknowns else max(unknowns, default=None)
    accuracy, aim = (
        "Error on the table's grooves, nu = 0, static and dynamic",
        f"{_words(REMEDY)}; the aim is 1,000, see 4x1 below",
    )
    figures = [
        at_most("table_groove_percent", accuracy, _worst(plain), "%", 1.0, against=against, note=several),
        at_most("table_groove_unknowns", "Unknowns of that level", most, "", 2000, against=aim),
        at_most("table_groove_nu_percent", "The same at nu = 0.3 and 0.49", _worst(ratios), "%", 1.0, against=against),
    ]
    return [*figures, _share([row for row in rows if row["nu"] == 0])]


def _percent(row: dict[str, Any]) -> str:
    return row["status"] if row["error"] is None else f"{row['error']:+.2f} %"


def _of_unknowns(row: dict[str, Any]) -> str:
    return "" if row["unknowns"] is None else f" ({row['unknowns']:.0f} unknowns)"


def _worst(rows: Sequence[dict[str, Any]]) -> float | None:
    """Largest error; None where a run failed or none was made."""
    if not rows or any(row["error"] is None for row in rows):
        return None
    return max(abs(row["error"]) for row in rows)


def _share(rows: Sequence[dict[str, Any]]) -> Figure:
    """Fewest unknowns within 0.5 %: those of the plate in percent of the reference's, the worse of both analyses."""
    shares = []
    for mode in ("static", "dynamic"):
        end = limit(0.0, mode)
        own = [r["unknowns"] for r in rows if r["mode"] == mode and r["error"] is not None and abs(r["error"]) <= 0.5]
        solid = [n for value, n in REFERENCE[0.0, mode].values() if abs(value / end - 1) <= 0.005]
        if own:
            shares.append(100 * min(own) / min(solid))
    worst = max(shares) if len(shares) == 2 else None
    return at_most("table_groove_half_percent_share", "Unknowns for 0.5 %, of the reference's", worst, "%", 10.0,
                   against="static and dynamic at nu = 0, levels shown below")  # fmt: skip


TABLE = (
    Column("level", "level", "wrap"),
    Column("nu", "nu", ".2f"),
    Column("mode", "analysis"),
    Column("unknowns", "unknowns", ",.0f"),
    Column("height", "height", ".5f", "m"),
    Column("error", "error", "+.2f", "%"),
    Column("cpu_seconds", "CPU", ".1f", "s"),
    Column("status", "status"),
)
EXTREME = (
    Column("groove", "groove", "wrap"),
    Column("level", "level", "wrap"),
    Column("height", "height", ".6f", "m"),
    Column("condition_stiffness", "condition of K", ".2e"),
    Column("condition_mass", "condition of M", ".2e"),
    Column("least_mass", "least eigenvalue of M", ".2e"),
    Column("critical_step", "2 / omega max", ".2e", "s"),
    Column("status", "status"),
)


ABOUT = (
    "The table's grooves cut 60 % of the thickness. Beside their edges the section warps, which a straight director "
    "cannot follow. The remedy: grid lines on the edges and beside them, and at the nodes that an indicator chooses "
    "the layer beyond the groove's floor shears on its own."
)


def _blocks(rows: Sequence[dict[str, Any]], extremes: Sequence[Outcome]) -> Iterator[Block]:
    yield Text([ABOUT])
    solid = [
        {"level": f"reference, h = {size:g}", "nu": nu, "mode": mode, "height": height, "unknowns": unknowns,
         "error": 100 * (height / limit(nu, mode) - 1) * -1, "status": "ok"}
        for (nu, mode), levels in REFERENCE.items() for size, (height, unknowns) in levels.items()
    ]  # fmt: skip
    yield Table("The table's grooves under the patch load", TABLE, [*rows, *solid], ["Error against the limit."])
    if len(rows) > 1:
        yield Plots(
            [(_plot(rows, solid, mode), f"Error against unknowns, {mode}, nu = 0") for mode in ("static", "dynamic")]
        )
    names = [column.key for column in EXTREME]
    shown = [
        {**{n: o.get(n) for n in names}, "groove": _groove(o.asked.arguments), "level": _words(o.asked.arguments),
         "status": o.measured.status}
        for o in extremes
    ]  # fmt: skip
    notes = ["K and M scaled to unit diagonals. 2 / omega max: the largest stable step of central differences."]
    yield Table("One groove on a square plate of 4 x 4 elements, nu = 0.3", EXTREME, shown, notes)
    yield case_table("A groove's edge 1e-9 m off a grid line", [*_continuity(extremes)])


def _plot(rows: Sequence[dict[str, Any]], solid: Sequence[dict[str, Any]], mode: str) -> str:
    kinds = {
        "conforming": ("ancf", lambda r: r.get("element") == "conforming"),
        "enriched": ("ancf exact", lambda r: r.get("element") == "enriched" and r.get("fit") is None),
        "enriched, fitted, layers": ("difference", lambda r: bool(r.get("enrich"))),
        "reference": ("reference", lambda r: "element" not in r),
    }
    series = []
    for label, (role, belongs) in kinds.items():
        own = [r for r in (*rows, *solid) if belongs(r) and r["mode"] == mode and r["nu"] == 0 and r["error"]]
        own.sort(key=lambda r: r["unknowns"])
        series.append(Series(label, role, [r["unknowns"] for r in own], [abs(r["error"]) for r in own]))
    about = "Error of the height in percent against the number of unknowns"
    return log_plot(f"grooves-{mode}", f"The table's grooves, {mode}", about, series, "unknowns", "error (%)")
