"""Thin and thick plates and curved shells under small loads, against the values that shell elements are judged by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compare.convergence import study
from compare.plots import Series, log_plot
from compare.report import Column, Plots, Table, Text
from compare.verdict import Figure, at_most
from reports.hard_cases.chapter import OK, Asked, Case, Chapter, Outcome, case_table
from reports.hard_cases.shell_cases import SHELLS, SOURCES, Shell

TITLE = "Plates and curved shells"
SOLVE = "hard_cases.shell_scenes.solve"
ELEMENTS = ("enriched", "conforming")
POINTS, OF_STRIPS = (4, 4, 3), (5, 5, 3)  # an element with two free edges needs more: its enhanced strains are more


def units(budget: str) -> list[Asked]:
    """One unit for each shell and solver: the elements' ladders, each begun with half the load on its first mesh."""
    asked = []
    for shell in SHELLS:
        about = {"shell": shell.scene, "about": shell.about}
        levels = [
            {"element": element, "mesh": mesh, "points": OF_STRIPS if 1 in mesh else POINTS}
            for element in ELEMENTS
            for mesh in shell.meshes(budget)
        ]
        runs = [{"load": shell.load, "level": level} for level in levels]
        if runs:
            half = {"load": shell.load / 2, "level": levels[len(shell.meshes(budget)) // 2]}
            asked.append(Asked(SOLVE, about | {"solver": "ancf", "runs": [*runs, half]}))
        runs = [{"load": shell.load, "level": {"size": size}} for size in shell.solids(budget)]
        if runs:
            asked.append(Asked(SOLVE, about | {"solver": "reference", "runs": runs}))
    return asked


@dataclass(frozen=True)
class Run:
    """What one run of a shell found: value in the source's terms, None where it failed; h is its element length."""

    shell: Shell
    element: str
    level: str
    h: float
    load: float
    value: float | None
    status: str
    unknowns: int | None
    expected: float | None = None

    @property
    def error(self) -> float | None:
        """Percent of the expected value."""
        return None if self.value is None or not self.expected else 100 * (self.value / self.expected - 1)


def _runs(outcomes: Sequence[Outcome]) -> Iterator[Run]:
    """Every run that was asked; those of a unit that died have its failure."""
    for outcome in outcomes:
        asked = outcome.asked.arguments
        shell = next(s for s in SHELLS if (s.scene, s.about) == (asked["shell"], asked["about"]))
        lost = {"status": outcome.measured.status, "move": None, "unknowns": None}
        found = outcome.get("runs") or [lost] * len(asked["runs"])
        for run, one in zip(asked["runs"], found, strict=True):
            yield _run(shell, run, one)


def _run(shell: Shell, run: dict[str, Any], found: dict[str, Any]) -> Run:
    level, move = run["level"], found["move"]
    value = None if move is None else shell.factor * move["XYZ".index(shell.component)]
    words, h, element = f"h = {level.get('size', 0):g}", level.get("size"), "solid"
    if "mesh" in level:
        words, h, element = "x".join(map(str, level["mesh"])), 1 / level["mesh"][0], level["element"]
    return Run(shell, element, words, h, run["load"], value, found["status"], found["unknowns"])


def present(outcomes: Sequence[Outcome]) -> Chapter:
    """The finest level of each element as a case; errors over the meshes; how linear the answers are."""
    runs = list(_runs(outcomes))
    cases, rows, plots = [], [], []
    for shell in SHELLS:
        own = _expecting([run for run in runs if run.shell is shell])
        ladders = {e: _ladder(own, e) for e in (*ELEMENTS, "solid")}
        ladders = {element: ladder for element, ladder in ladders.items() if ladder}
        cases += [_case(ladder[-1]) for ladder in ladders.values()]
        rows += [_row(ladder) for ladder in ladders.values()]
        plots += [_plot(shell, ladders)] if any(run.error for run in own) else []
    blocks = [
        Text(READING),
        case_table("Finest level of each", cases),
        Table("Errors over the meshes, coarse to fine", LADDERS, rows, LADDER_NOTES),
        Plots(plots),
    ]
    return Chapter(cases, [_nonlinearity(runs)], blocks)


def _expecting(runs: Sequence[Run]) -> list[Run]:
    """The runs of a shell with what is expected of them: where nothing is published, what the finest solid found."""
    solids = [run.value for run in runs if run.element == "solid"]
    return [replace(run, expected=run.shell.expected or (solids[-1] if solids else None)) for run in runs]


def _ladder(runs: Sequence[Run], element: str) -> list[Run]:
    return [run for run in runs if run.element == element and run.load == run.shell.load]


def _case(run: Run) -> Case:
    """Nothing is asked of the conforming element, whose locking is known."""
    shell, solver = run.shell, "reference" if run.element == "solid" else "ancf"
    allowed = {"enriched": shell.allowed, "solid": shell.allowed_solid}.get(run.element)
    against = "as above; nothing asked" if run.element == "conforming" else shell.against
    name, level = f"{shell.title} [{run.element}]", f"{run.element} {run.level}"
    return Case(name, solver, level, run.value, shell.unit, run.expected, allowed, against, run.status)


def _row(ladder: Sequence[Run]) -> dict[str, Any]:
    """A ladder in one line: its last three errors and the order of the values."""
    first = ladder[0]
    errors = [run.error for run in ladder][-3:]
    keys = ("coarse", "medium", "fine")[-len(errors) :]
    failed = [run.status for run in ladder if run.status != OK]
    return {
        "shell": first.shell.title,
        "element": first.element,
        "levels": ", ".join(run.level for run in ladder[-3:]),
        **dict(zip(keys, errors, strict=True)),
        "order": study([run.h for run in ladder], [run.value for run in ladder]).order,
        "unknowns": ladder[-1].unknowns,
        "status": failed[0] if failed else OK,
    }


def _plot(shell: Shell, ladders: dict[str, list[Run]]) -> tuple[str, str]:
    """Errors over the unknowns."""
    series = []
    for element, ladder in ladders.items():
        solved = [run for run in ladder if run.error is not None]
        x, y = [run.unknowns for run in solved], [abs(run.error) for run in solved]
        series.append(Series(element, ROLES[element], x, y))
    name = "shell-" + "".join(letter if letter.isalnum() else "-" for letter in shell.title.lower())
    about = f"Error in percent of the expected value against the number of unknowns: {', '.join(ladders)}."
    caption = shell.title[0].upper() + shell.title[1:] + "."
    return log_plot(name, shell.title, about, series, "unknowns", "|error| (%)"), caption


def _nonlinearity(runs: Sequence[Run]) -> Figure:
    """The largest change by halving a load, as a share of its case's tolerance."""
    shares = {}
    for half in (run for run in runs if run.element != "solid" and run.load != run.shell.load):
        whole = next(r for r in _ladder(runs, half.element) if r.shell is half.shell and r.level == half.level)
        if half.value is not None and whole.value is not None and half.shell.allowed is not None:
            shares[half.shell.title] = 100 * abs(whole.value / half.value - 1) / half.shell.allowed * 100
    worst = max(shares, key=shares.get, default=None)
    return at_most(
        "shells_nonlinearity_percent",
        "Shells: largest change of value / load when the load is halved, of the case's tolerance",
        shares.get(worst),
        "%",
        10.0,
        against="the tolerance of each case",
        note="" if worst is None else f"{len(shares)} shells; the largest: {worst}.",
    )


ROLES = {"enriched": "ancf exact", "conforming": "ancf", "solid": "reference"}
LADDERS = (
    Column("shell", "shell", "wrap"),
    Column("element", "element"),
    Column("levels", "levels"),
    Column("coarse", "coarse", "+.3g", "%", group="error"),
    Column("medium", "medium", "+.3g", "%", group="error"),
    Column("fine", "fine", "+.3g", "%", group="error"),
    Column("order", "order", ".2f", "observed"),
    Column("unknowns", "unknowns", ",d", "fine"),
    Column("status", "status"),
)
LADDER_NOTES = (
    "Order: of the values towards their own limit, which is not the published value. Where a force acts at a point "
    "there is no limit, and an order is the mesh's before that shows.",
)
READING = (
    SOURCES,
    "Both solvers are nonlinear, so the loads are small parts of the sources' (a figure of the verdict says what is "
    "left of nonlinearity) and the displacements are scaled up. Nothing is asked of the paper's conforming element: "
    "above ν = 0 its bending is too stiff on any mesh, and the thinner a shell the more it locks in shear and stretch.",
    "The enriched element does not lock on thin flat plates, the straight or the twisted beam. On thin curved shells "
    "coarse meshes of it keep a part of membrane locking: on the hemisphere 8x8 elements are 2 % too stiff at "
    "t / R = 4/1000 and 31 % ten times thinner, 16x16 are 0.4 % and 4 %.",
    "A tensor grid has four corners. At the pole of a sphere, and in the middle of the rim of a quarter disc, the two "
    "tangents of a patch would be parallel or one of them vanish, and an ANCF node there has no normal. So disc and "
    "sphere have a small free hole: the disc is judged by the closed form of the annulus, and on the sphere holes of "
    "1 and 2 degrees differ by 0.02 %, 2 and 4 by 0.06 %.",
)
