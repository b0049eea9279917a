"""The page of the integration study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare import figures as pictures
from compare.plots import Series, log_plot
from compare.report import Bullets, Column, Commands, Facts, Gallery, Page, Plots, Section, Table, Text, Verdict
from compare.result import Outline
from compare.sketch import sketch
from compare.verdict import Figure
from reports.integration import cases

TITLE = "Integration of local geometry"
LEAD = (
    "Fig. 4 of He, Patel and Shabana on one element of 1 x 1 x 0.05 m and 1500 kg/m³, mass and stiffness, global rule "
    "and subdomains, on grooves of any outline and on the tread catalogue."
)
ROLE = {"subdomain": "ancf", "global": "reference"}
ERRORS = (
    Column("case", "case"),
    Column("points3", "mass", ".1e", "", "3 points per subdomain", "3 per subdomain"),
    Column("stiff3", "stiffness", ".1e", "", "", "3 per subdomain"),
    Column("points4", "mass", ".1e", "", "", "4 per subdomain"),
    Column("stiff4", "stiffness", ".1e", "", "", "4 per subdomain"),
    Column("plane4", "points", "d", "", "points in the plane of the element", "4 per subdomain"),
    Column("ms4", "time", ".3g", "ms", "", "4 per subdomain"),
    Column("global40", "mass", ".1e", "", "", "40 x 40 global"),
    Column("stiff40", "stiffness", ".1e", "", "", "40 x 40 global"),
    Column("ms40", "time", ".3g", "ms", "", "40 x 40 global"),
)
VOLUMES = (
    Column("case", "case"),
    Column("grooves", "grooves", "d"),
    Column("volume", "volume", ".9g", "m³"),
    Column("void", "void ratio", ".6g", "", "part of the face that is cut away"),
    Column("volume_error", "volume", ".1e", "", "relative", "against the solid of gmsh"),
    Column("centroid_error", "centroid", ".1e", "m", "", "against the solid of gmsh"),
    Column("inertia_error", "inertia", ".1e", "", "relative", "against the solid of gmsh"),
    Column("status", "status"),
)


def page(
    judged: Sequence[Figure], rows: Sequence[dict[str, Any]], volumes: Sequence[dict[str, Any]], about: dict[str, Any]
) -> Page:
    """The page of measured rows, volumes and judged figures."""
    facts = [(key, value) for key, value in about.items() if key != "versions"]
    versions = ", ".join(f"{name} {number or 'absent'}" for name, number in about["versions"].items())
    parts = [
        Section("verdict", "Verdict", [Verdict(judged)]),
        Section("figure-4", "Fig. 4", [Text([FIGURE_4]), Plots(_plots("Fig. 4", rows))]),
        Section("errors", "Every case", [_errors(rows), Plots(_shared(rows)), Bullets(READING)], "Cases"),
        Section("treads", "Tread catalogue", [Plots(_sketches()), Gallery(*_gallery())], "Treads"),
        Section("volumes", "Volumes", [Table("Plate rule and the solid of gmsh", VOLUMES, volumes)]),
        Section("again", "Every number again", [Commands([("make integration", "this page")])], "Again"),
        Section("provenance", "Provenance", [Facts([*facts, ("versions", versions)])]),
    ]
    return Page(TITLE, LEAD, parts, f"Groovecheck, {about['date']}")


FIGURE_4 = (
    "The curve of Fig. 4(b) is lost with the figure. Chosen here: the groove lies in [0.4, 0.6] of the width, "
    "0.02 m deep, its walls are parabolas. It divides the element into five parts along y, in "
    "which the number of points grows; along x there are four at least. Errors are norms of the "
    "difference of matrices, a stricter measure than the difference of norms that the paper plots."
)
READING = [
    "Points are counted in the element's plane. A rule over a cut element is thinned to the fewest points that keep "
    "its degree over each part of one depth, so it does not grow with the number of grooves.",
    "Time is that of rule and matrices together, the CPU time of one element; it is spent once, before the first step.",
    "The section of the half round is rational: no rule is exact for it, and its error falls exponentially.",
]


def _of(rows: Sequence[dict[str, Any]], case: str, rule: str) -> list[dict[str, Any]]:
    return [row for row in rows if row["case"] == case and row["rule"] == rule]


def _series(rows, case: str, x: str, y: str) -> list[Series]:
    found = []
    for rule, role in ROLE.items():
        own = _of(rows, case, rule)
        found.append(Series(rule, role, [row[x] for row in own], [max(row[y], 1e-17) for row in own]))
    return found


def _plots(case: str, rows: Sequence[dict[str, Any]]) -> list[tuple[str, str]]:
    """Norm and errors of one case against points and time; none where it was not run."""
    made = []
    if not any(row["case"] == case for row in rows):
        return made
    norm = "norm of the mass matrix (kg)"
    panels = (
        ("points", "points in the plane", "mass_norm", norm, "Fig. 4(c): norm of the mass matrix against points."),
        ("points", "points in the plane", "mass_error", "error of the mass matrix", "Error of the mass matrix."),
        (
            "points",
            "points in the plane",
            "stiffness_error",
            "error of the stiffness",
            "Error of the stiffness at rest.",
        ),
        ("seconds", "CPU time (s)", "mass_error", "error of the mass matrix", "Speed against error."),
    )
    for number, (x, xlabel, y, ylabel, caption) in enumerate(panels):
        svg = log_plot(
            f"integration-{number}", caption, f"{ylabel} against {xlabel}", _series(rows, case, x, y), xlabel, ylabel
        )
        made.append((svg, caption))
    return made


def _shared(rows: Sequence[dict[str, Any]]) -> list[tuple[str, str]]:
    """Errors of every tread against points."""
    made = []
    run = {row["case"] for row in rows}
    for number, name in enumerate(name for name in cases.NAMES if name.endswith("tread") and name in run):
        caption = f"{name}: error of the mass matrix against points."
        series = _series(rows, name, "points", "mass_error")
        svg = log_plot(f"tread-{number}", caption, caption, series, "points in the plane", "error of the mass matrix")
        made.append((svg, caption))
    return made


def _errors(rows: Sequence[dict[str, Any]]) -> Table:
    table = []
    for case in cases.NAMES:
        row: dict[str, Any] = {"case": case}
        for rule, count, keys in (
            ("subdomain", 3, ("points3", "stiff3", None, None)),
            ("subdomain", 4, ("points4", "stiff4", "plane4", "ms4")),
            ("global", 40, ("global40", "stiff40", None, "ms40")),
        ):
            for found in (r for r in _of(rows, case, rule) if r["count"] == count):
                values = found["mass_error"], found["stiffness_error"], found["points"], 1e3 * found["seconds"]
                row |= {key: value for key, value in zip(keys, values, strict=True) if key}
        table.append(row)
    return Table("Relative errors of mass and stiffness of one element", ERRORS, table)


def _sketches() -> list[tuple[str, str]]:
    found = []
    for name in cases.NAMES:
        if name.endswith("tread"):
            scene = cases.scene(name)
            found.append(
                (sketch(scene), f"{name}: {100 * scene.tread.void:g} % of the face, {scene.tread.depth:g} m deep")
            )
    return found


def _gallery() -> tuple[Sequence[pictures.Picture], Sequence[str], str]:
    """Pictures of all cases from below."""
    from ancf.mesh import grid
    from ancf.outline import facets
    from ancf.unpack import bands_of

    jobs, mesh = [], grid(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    for name in cases.NAMES:
        scene = cases.scene(name)
        surface = facets(mesh, bands_of(scene), scene.thickness)
        outline = Outline(surface.points, np.zeros_like(surface.points), surface.triangles, surface.edges)
        jobs.append(
            pictures.Job(name.replace(" ", "-"), f"{name}, seen from below", "mesh", "ancf", outline, below=True)
        )
    made, reason = pictures.render(jobs)
    missing = [job.name for job in jobs[len(made) :]]
    return made, missing, reason
