"""What the speed exhibit is judged by, and what it states beside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.verdict import Figure, at_least, at_most, stated
from reports.speed_curves import NAMES, Curves, cheapest
from reports.unit import Measured

Found = dict[str, Any]


def figures(found: Found) -> list[Figure]:
    """Every number that the exhibit is judged by, each with the command that measures it again in its note."""
    return [
        *_kernel_figures(found["kernels"], found["growth"]),
        *_rubber_figures(found["rubber"]),
        *_run_figures(found),
        *_reference_figures(found),
        *_cost_figures(found),
    ]


def _kernel_figures(kernels: Measured, growth: Sequence[Measured]) -> list[Figure]:
    rows = {row["plate"]: row for row in kernels.get("rows") or []}
    plain = rows.get("plain", {})
    grooves = [rows[name] for name in ("plain", "one groove", "five grooves") if name in rows]
    worst = {what: max((row[f"{what}_us"] for row in grooves), default=None) for what in ("force", "tangent")}
    words = "Dearest of plain, one groove and five grooves on 16x16 elements, element arrays alone, CPU time."
    note = _note(kernels, f"{words} With the sums into the global matrix: {_us(plain, 'assembled_tangent')} plain.")
    against = "cross-code: Chrono's C++ plate with the same coordinates takes 35 to 47 (tangent) and 2.7 to 5 (force)"
    ratio = (
        "Dearer of one and five grooves over plain, 256 elements, least of many calls over least of many. "
        f"{_median(kernels)}{_grown(growth)}"
    )
    return [
        at_most("tangent_us", "Tangent of an ANCF element", worst["tangent"], "µs", 15, against=against, note=note),
        at_most("force_us", "Internal force of an ANCF element", worst["force"], "µs", 3, against=against, note=note),
        at_most(
            "tangent_groove_ratio",
            "Tangent with grooves over tangent without",
            kernels.get("tangent_groove_ratio"),
            "",
            1.1,
            against="the plain plate in the same process",
            note=_note(kernels, ratio),
        ),
    ]


def _rubber_figures(measured: Measured) -> list[Figure]:
    """Mooney-Rivlin elements of the paper's tire mesh with four grooves, as they are by default."""
    judged = ("conforming", "relaxed", "four grooves")
    rows = measured.get("rows") or []
    row = next((r for r in rows if (r["element"], r["volumetric"], r["plate"]) == judged), {})
    points = f", {row['points']:.1f} points per element" if row else ""
    note = _note(measured, f"Conforming, thickness strain free at each point, four grooves, 24x10 elements{points}.")
    against = "cross-code: the best C++ peer takes 4 to 6 (force) and 44 to 61 (tangent) without grooves"
    force, tangent = row.get("force_us"), row.get("tangent_us")
    return [
        at_most("rubber_force_us", "Force of a Mooney-Rivlin element", force, "µs", 10, against=against, note=note),
        at_most("rubber_tangent_us", "Tangent of a Mooney-Rivlin one", tangent, "µs", 60, against=against, note=note),
    ]


def _median(kernels: Measured) -> str:
    """The ratio that a busy machine shows, in words."""
    median = kernels.get("median_groove_ratio")
    words = "Median over rounds, in which other processes take the larger tensors of grooves from the cache: "
    return "" if median is None else f"{words}{median:.3f}. "


def _grown(growth: Sequence[Measured]) -> str:
    """The ratio of five grooves over plain on the larger plates, in words."""
    words = []
    for run in growth:
        ratio = {row["plate"]: row.get("tangent_ratio") for row in run.get("rows") or []}.get("five grooves")
        if ratio is not None:
            words.append(f"{ratio:.3f} on {run.arguments['mesh'] ** 2} elements")
    return f"Five grooves alone, measured apart: {', '.join(words)}." if words else ""


def _us(row: dict[str, Any], what: str) -> str:
    return f"{row[f'{what}_us']:.1f} µs" if row else "not run"


def _note(measured: Measured | None, words: str) -> str:
    """A figure's note: what it is, why it is missing where it is, and the command."""
    if measured is None:
        return f"{words} Not in this budget."
    reason = "" if measured.ok else f" {measured.status}."
    return f"{words}{reason} Again: {measured.command}"


def _run_figures(found: Found) -> list[Figure]:
    sixteen = next((m for m in found["ancf"] if m.arguments["mesh"] == 16), None)
    table5 = found["table5"]
    return [
        at_most(
            "cantilever16_cpu_s",
            "Plain cantilever, 16x16 ANCF elements, 200 implicit steps",
            sixteen and sixteen.get("cpu_seconds"),
            "s CPU",
            10,
            against="cross-code: Chrono's C++ plate with the same coordinates takes 40.7 s",
            note=_note(sixteen, "Mesh and set-up included, interpreter start excluded."),
        ),
        at_most(
            "table5_wall_s",
            "Table 5, both columns, 2x2 to 16x16, dt = 0.01 s",
            table5 and table5.get("wall_seconds"),
            "s",
            60,
            against="the bar alone",
            note=_note(table5, "Wall time of the study of 16 runs in two processes, cheap runs up to three times."),
        ),
    ]


def least(runs: Sequence[Measured], name: str) -> float | None:
    """Least of a value over repeated runs, None where none succeeded."""
    return min((run.get(name) for run in runs if run.ok and run.get(name) is not None), default=None)


def _reference_figures(found: Found) -> list[Figure]:
    ours, theirs, many = found["reference"], found["calculix"], found["many"]
    whole = [run for run in ours if run.get("steps") == 100]
    mine = least(whole, "cpu_seconds")
    peer = least([run for run in theirs if run.get("steps") == 100], "cpu_seconds")
    at = f"{ours[0].get('unknowns')} unknowns, {ours[0].get('tetrahedra')} tetrahedra" if ours[0].ok else "not run"
    steps = f"{ours[0].get('steps')} steps" if ours[0].ok else ""
    absent = f" CalculiX: {theirs[0].status}." if theirs and not theirs[0].ok else ""
    alternating = f"Same mesh ({at}), same {steps}, runs in turn; whole ccx process over our solve, both CPU.{absent}"
    return [
        at_most(
            "reference_5532_cpu_s",
            "Reference: 100 steps on the mesh nearest to 5,532 unknowns",
            least(whole, "cpu_seconds"),
            "s CPU",
            8,
            against="cross-code: CalculiX 2.20 takes about 40 s on 875 C3D10 tetrahedra",
            note=_note(ours[0], f"{at}, mesh and set-up included, least of {len(whole)}."),
        ),
        stated(
            "calculix_cpu_ratio",
            "CalculiX over the reference, same C3D10 mesh and steps",
            peer / mine if peer and mine else None,
            "",
            against="cross-code: CalculiX in this run",
            note=_note(theirs[0] if theirs else None, alternating),
        ),
        *_many_figures(many),
    ]


def _many_figures(many: Measured | None) -> list[Figure]:
    size = f"{many.get('unknowns')} unknowns" if many and many.ok else "100,000 unknowns"
    return [
        at_most(
            "reference_100k_step_s",
            "Reference: slowest time step at 100,000 unknowns",
            many and many.get("slowest_step_seconds"),
            "s",
            10,
            against="the bar alone",
            note=_note(many, f"{size}; wall time with assembly and the analysis of the pattern in the first step."),
        ),
        at_most(
            "reference_100k_newton_s",
            "Reference: one full Newton iteration at 100,000 unknowns",
            many and many.get("newton_seconds"),
            "s",
            3,
            against="cross-code: ngsolve takes 8.7 s, CalculiX about 20 s",
            note=_note(many, f"{size}; wall time of tangent, factorisation, solution and residual."),
        ),
    ]


def _cost_figures(found: Found) -> list[Figure]:
    """What 1 % and 0.1 % cost a peer over what they cost the cheaper ANCF element."""
    curves = Curves.of(found["curve"], found["curve_calculix"])
    against = "cross-code: the other solver on the same question"

    def told(percent: float, peer: str, measured: Measured | None) -> tuple[float | None, str]:
        ratio, why = curves.ratio(percent, peer=peer)
        cpu, _ = curves.ratio(percent, "cpu", peer)
        why += "" if cpu is None else f" The ratio of CPU times is {cpu:.3g}."
        words = f"Patch-loaded plain cantilever, wall time, same steps; errors from {curves.target_words}. {why}"
        return ratio, _note(measured, words)

    label = "Cost to {} %: {} over ANCF"
    one, why = told(1.0, "reference", found["curve"])
    theirs, theirs_why = told(1.0, "calculix", next(iter(found["curve_calculix"]), None))
    tenth, tenth_why = told(0.1, "reference", found["curve"])
    ours = label.format(1, "reference")
    judged = at_least("cost_ratio_1_percent", ours, one, "", 50, against=against, note=why)
    cross = "cross-code: CalculiX on the reference's C3D10 meshes, whole ccx process"
    ccx = label.format(1, "CalculiX")
    return [
        judged,
        _bound_figure(found["one_percent"], found["kernels"].get("product_gflops")),
        stated("cost_ratio_1_percent_calculix", ccx, theirs, "", against=cross, note=theirs_why),
        _own_steps_figure(found["own_steps"], curves),
        stated("cost_ratio_0.1_percent", label.format(0.1, "reference"), tenth, "", against=against, note=tenth_why),
    ]


def _bound_figure(runs: Sequence[Measured], gflops: float | None) -> Figure:
    """The ratio that would be left if ANCF's run to 1 % were nothing but its products, factors and solutions."""
    ratio, words = None, "CPU of the reference's first level within 1 % over that of the linear algebra of ANCF's"
    if runs and gflops and all(run.ok for run in runs):
        ours, solid = runs
        theirs, setup, gflop = solid.get("cpu_seconds"), ours.get("setup_seconds"), ours.get("gflop")
        least = sum(number for part, number in gflop.items() if part != "set-up") / gflops
        called = sum(ours.get("bare").values())
        ratio = theirs / least
        words += (
            f": {1e3 * least:.2g} ms if all of it ran at the {gflops:.0f} GFlop/s of a large matrix product here. "
            f"Called through NumPy and LAPACK with nothing between it takes {1e3 * called:.2g} ms, which leaves "
            f"{theirs / called:.3g}; with the present set-up of {1e3 * setup:.2g} ms, {theirs / (called + setup):.3g}; "
            f"as measured, {theirs / ours.get('cpu_seconds'):.3g}."
        )
    label = "Cost to 1 %: greatest ratio that this element, mesh and steps admit"
    against = "operations of the products, factors and solutions at the speed of a BLAS product in this run"
    note = _note(runs[0] if runs else None, words)
    return stated("cost_ratio_1_percent_bound", label, ratio, "", against=against, note=note)


def _own_steps_figure(measured: Measured | None, curves: Curves) -> Figure:
    """Both solvers at the mesh and time step that suit them best."""
    ratio, words = None, "Each solver at its own cheapest mesh and time step within 1 % of the limit in space and time."
    if measured and measured.ok and curves.target:
        limit = curves.target + measured.get("time_shift")
        best = [cheapest(measured.get("rows"), series, limit, 1.0) for series in ("enriched", "reference")]
        words += f" Limit {limit:.6f} m."
        for row in filter(None, best):
            words += f" {NAMES[row['series']]}: {row['mesh']}, {row['steps']} steps, {row['wall_seconds']:.3g} s."
        ratio = best[1]["wall_seconds"] / best[0]["wall_seconds"] if all(best) else None
    against = "cross-code: the other solver on the same question"
    label = "Cost to 1 %, own mesh and steps: reference over ANCF"
    return stated("cost_ratio_1_percent_own_steps", label, ratio, "", against=against, note=_note(measured, words))
