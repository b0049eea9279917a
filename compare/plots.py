"""Plots as inline SVG: values, errors, work, histories and sensitivities.

Colours are the colour-blind safe set of Okabe and Ito (2008); the marker's shape repeats what the
colour says. The axes take the page's text colour and every series a CSS variable, so that one
drawing serves light, dark and print. Equal input gives equal bytes: no date, ids hashed with the
plot's name.
"""

from __future__ import annotations

import html
import io
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

INK = "#123456"  # stands for the page's text colour until the drawing is themed
SIZE = (5.6, 3.7)
SERIES = "series-"  # begins the name of a line that the page's script knows
POINTS_PER_INCH = 72  # units of the drawing


@dataclass(frozen=True)
class Look:
    """How one role is drawn: colour (light page), CSS variable, marker and line style."""

    colour: str
    variable: str
    marker: str
    line: str


ROLES = {
    "ancf": Look("#0072b2", "--ancf", "o", "-"),
    "ancf exact": Look("#56b4e9", "--ancf-exact", "^", "--"),
    "reference": Look("#d55e00", "--reference", "s", "-"),
    "paper": Look("#009e73", "--paper", "D", ""),
    "difference": Look("#cc79a7", "--difference", "v", "-"),
    "third": Look("#b8a800", "--third", "X", "-."),
}

SETTINGS = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 10.5,
    "axes.labelsize": 10.5,
    "xtick.labelsize": 10,
    "ytick.labelsize": 10,
    "legend.fontsize": 10,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": INK,
    "grid.alpha": 0.14,
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.8,
    "lines.markersize": 6.5,
    "legend.frameon": False,
    "legend.labelcolor": INK,
}


@dataclass(frozen=True)
class Series:
    """One line of a plot: x and y (n,), in the units of the axes; `role` is a key of ROLES."""

    label: str
    role: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Limit:
    """Where a ladder ends and tends: finest value, Richardson value and band low..high; None where there is none.

    A printed converged value has the role "paper" and only `finest`.
    """

    label: str
    role: str
    finest: float
    richardson: float | None = None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Bar:
    """One bar: its length `value`, measured from zero."""

    label: str
    role: str
    value: float


def value_plot(
    name: str, title: str, about: str, ylabel: str, series: Sequence[Series], limits: Sequence[Limit]
) -> str:
    """Values against element size h (m) and, magnified beside them, the limits with their bands, as SVG text."""

    def paint(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (2.7, 1), "wspace": 0.04})
        for line in series:
            _line(left, line)
        for place, limit in enumerate(limits):
            _limit(left, right, place, limit)
        left.set(xlabel="element size h (m)", ylabel=ylabel)
        left.set_xlim(left=0.0)
        left.margins(y=0.08)
        right.set_xlabel("finest, ± band")
        right.set_xlim(-0.7, max(len(limits), 1) - 0.3)
        right.margins(y=0.15)
        right.set_xticks([])
        right.yaxis.tick_right()
        right.yaxis.set_major_locator(MaxNLocator(6))
        right.spines[["left", "right"]].set_visible(False)
        _legend(figure, left)

    return _draw(name, title, about, paint)


def log_plot(name: str, title: str, about: str, series: Sequence[Series], xlabel: str, ylabel: str) -> str:
    """Positive values on two logarithmic axes as SVG text; points that are not positive are left out."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        for line in series:
            x, y = np.asarray(line.x, float), np.asarray(line.y, float)
            shown = (x > 0) & (y > 0)
            _line(axes, Series(line.label, line.role, x[shown], y[shown]))
        axes.set(xlabel=xlabel, ylabel=ylabel, xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            _log_ticks(axis)
        _legend(figure, axes)

    return _draw(name, title, about, paint)


def history_plot(
    name: str, title: str, about: str, labels: tuple[str, str], paths: Sequence[Series], residual: Series | None
) -> str:
    """Values (m) over time or load and, below them, their difference in millimetres as SVG text; labels: x and y."""

    def paint(figure: Figure) -> None:
        rows = 2 if residual else 1
        panels = figure.subplots(
            rows, 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": (3, 1)[:rows], "hspace": 0.14}
        )[:, 0]
        for path in paths:
            look = ROLES[path.role]
            style = "-" if path.role == "ancf" else (0, (5, 2))
            gid = _gid(panels[0])
            panels[0].plot(path.x, path.y, color=look.colour, linestyle=style, label=path.label, marker="", gid=gid)
            panels[0].plot(path.x[-1:], path.y[-1:], color=look.colour, marker=look.marker, linestyle="")
        panels[0].set_ylabel(labels[1])
        if residual:
            panels[1].axhline(0.0, color=INK, linewidth=0.8)
            colour = ROLES[residual.role].colour
            panels[1].plot(residual.x, residual.y, color=colour, label=residual.label, gid=_gid(panels[1]))
            panels[1].set_ylabel("diff. (mm)")
            panels[1].yaxis.set_major_locator(MaxNLocator(3))
        panels[-1].set_xlabel(labels[0])
        _legend(figure, *panels)

    return _draw(name, title, about, paint, (SIZE[0], SIZE[1] * 1.15))


def map_plot(
    name: str, title: str, about: str, x: Sequence[float], y: Sequence[float], values: Sequence[float], label: str
) -> str:
    """Values at points (x, y) in m as coloured dots; none where the value is zero, only a small cross. SVG text."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        at, size = np.column_stack([x, y]), np.asarray(values, float)
        none = size <= 0
        axes.plot(*at[none].T, color=INK, marker="x", linestyle="none", markersize=3.5, alpha=0.45, label="not pressed")
        shown = axes.scatter(*at[~none].T, c=size[~none], cmap="viridis", s=26, vmin=0.0)
        figure.colorbar(shown, ax=axes, label=label)
        axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        axes.plot([], [], color=shown.cmap(0.6), marker="o", linestyle="none", label="pressed")  # seen on any page
        _legend(figure, axes)

    return _draw(name, title, about, paint, (SIZE[0], SIZE[1] * 1.2))


def bar_plot(name: str, title: str, about: str, bars: Sequence[Bar], xlabel: str) -> str:
    """Horizontal bars from zero, each with its value written at its end, as SVG text."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        places = np.arange(len(bars))[::-1]
        looks = [ROLES[bar.role] for bar in bars]
        axes.barh(places, [bar.value for bar in bars], height=0.62, color=[look.colour for look in looks])
        reach = max((abs(bar.value) for bar in bars), default=1.0) or 1.0
        for place, bar in zip(places, bars, strict=True):
            side = "left" if bar.value >= 0 else "right"
            pad = 0.02 * reach if bar.value >= 0 else -0.02 * reach
            text = f"{bar.value:+.2f}".replace("-", "\u2212").replace("\u22120.00", "0.00")
            axes.text(bar.value + pad, place, text, ha=side, va="center")
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_yticks(places, [bar.label for bar in bars])
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(xlabel)
        axes.margins(x=0.3)
        axes.grid(axis="y", visible=False)

    return _draw(name, title, about, paint, (SIZE[0], 1.0 + 0.34 * max(len(bars), 2)))


def _line(axes, series: Series) -> None:
    look = ROLES[series.role]
    hollow = {"fillstyle": "none", "markersize": 10} if series.role == "paper" else {}
    style = {"color": look.colour, "marker": look.marker, "linestyle": look.line or "none", **hollow}
    axes.plot(series.x, series.y, label=series.label, gid=_gid(axes), **style)


def _gid(axes) -> str:
    """Name of the next line of a plot that a reader may ask for values and switch off."""
    return f"{SERIES}{sum(len(panel.lines) for panel in axes.figure.axes)}"


def _limit(left, right, place: int, limit: Limit) -> None:
    """Band in both panels; in the right one the finest value filled and the Richardson value hollow."""
    look = ROLES[limit.role]
    if limit.role == "paper":
        for axes, label in ((left, limit.label), (right, None)):
            axes.axhline(limit.finest, color=look.colour, linewidth=1.5, linestyle=(0, (1, 1.6)), label=label)
        return
    if limit.low is not None:
        if limit.role != "ancf exact":
            left.axhspan(limit.low, limit.high, color=look.colour, alpha=0.18, linewidth=0)
        half = [[limit.finest - limit.low], [limit.high - limit.finest]]
        right.errorbar([place], [limit.finest], yerr=half, color=look.colour, capsize=5)
    right.plot([place], [limit.finest], color=look.colour, marker=look.marker)
    if limit.richardson is not None:
        right.plot([place], [limit.richardson], color=look.colour, marker=look.marker, fillstyle="none", markersize=8)


def _log_ticks(axis) -> None:
    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if high < 1e4 * low else (1.0,)
    axis.set_major_locator(LogLocator(base=10, subs=subs, numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def _legend(figure: Figure, *panels) -> None:
    """One legend below the axes, in as many columns as fit."""
    handles, labels = [], []
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.append(handle)
            labels.append(label)
    if handles:
        columns = 2 if max(map(len, labels)) < 34 else 1
        figure.legend(handles, labels, loc="outside lower left", ncols=columns, handlelength=2.4, borderaxespad=0.2)


def _draw(name: str, title: str, about: str, paint: Callable[[Figure], None], size: tuple[float, float] = SIZE) -> str:
    """The drawing as an <svg> element to stand inside HTML, titled and described for screen readers."""
    with matplotlib.rc_context({**SETTINGS, "svg.hashsalt": name}):
        figure = Figure(figsize=size, layout="constrained")
        figure.patch.set_alpha(0.0)
        paint(figure)
        for axes in figure.axes:
            axes.patch.set_alpha(0.0)
        file = io.StringIO()
        figure.savefig(file, format="svg")
    return _themed(file.getvalue(), name, title, about, _points(figure), _panels(figure))


def _points(figure: Figure) -> list[dict[str, Any]]:
    """The named lines as the page's script reads them: label, axes, values (6 digits) and places in the drawing."""
    found, (_, high) = [], figure.get_size_inches() * POINTS_PER_INCH
    xlabels = [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
    for line in (line for axes in figure.axes for line in axes.lines if (line.get_gid() or "").startswith(SERIES)):
        axes, values = line.axes, np.column_stack([line.get_xdata(), line.get_ydata()]).astype(float)
        at = axes.transData.transform(values) * POINTS_PER_INCH / figure.dpi
        seen = np.isfinite(at).all(axis=1)
        look = next(look for look in ROLES.values() if look.colour == line.get_color())
        found.append(
            {
                "id": line.get_gid(),
                "panel": figure.axes.index(axes),
                "label": line.get_label(),
                "colour": f"var({look.variable})",
                "xlabel": axes.get_xlabel() or (xlabels[-1] if xlabels else ""),
                "ylabel": axes.get_ylabel(),
                "x": [float(f"{x:.6g}") for x in values[seen, 0]],
                "y": [float(f"{y:.6g}") for y in values[seen, 1]],
                "at": [[round(x, 1), round(high - y, 1)] for x, y in at[seen].tolist()],
            }
        )
    return found


def _panels(figure: Figure) -> list[dict[str, Any]]:
    """The axes as the page's script reads them: box [left, top, right, bottom] in the drawing, limits and scales."""
    found, (_, high) = [], figure.get_size_inches() * POINTS_PER_INCH
    for axes in figure.axes:
        (left, bottom), (right, top) = axes.get_window_extent().get_points() * POINTS_PER_INCH / figure.dpi
        box = [round(float(edge), 2) for edge in (left, high - top, right, high - bottom)]
        limits = {name: [*map(float, getattr(axes, f"get_{name}lim")())] for name in "xy"}
        logs = {f"log{name}": getattr(axes, f"get_{name}scale")() == "log" for name in "xy"}
        found.append({"box": box, "labels": [axes.get_xlabel(), axes.get_ylabel()], **limits, **logs})
    return found


def _themed(
    svg: str, name: str, title: str, about: str, points: Sequence[dict[str, Any]], panels: Sequence[dict[str, Any]]
) -> str:
    """Matplotlib's document as an inline element: no prologue, date or global style, colours from the page."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>|<style type=\"text/css\">.*?</style>|<!--.*?-->", "", svg, flags=re.S)
    svg = re.sub(r"<defs>\s*</defs>", "", svg).replace("xlink:href", "href")
    svg = svg.replace(INK, "currentColor")
    for look in ROLES.values():
        svg = svg.replace(look.colour, f"var({look.variable}, {look.colour})")
    used = set(re.findall(r"(?:href=\"#|url\(#)([^\")]+)", svg))
    svg = re.sub(rf' id="({SERIES}\d+)"', r' data-series="\1"', svg)
    svg = re.sub(r' id="axes_\d+"', ' data-panel=""', svg)
    svg = re.sub(r' id="([xy])tick_\d+"', r' data-tick="\1"', svg)
    svg = re.sub(r" id=\"([^\"]+)\"", lambda found: found[0] if found[1] in used else "", svg)
    svg = re.sub(r"font: ([\d.]+px) [^;\"]+", r"font-size: \1", svg)
    box = re.search(r"viewBox=\"[^\"]+\"", svg)[0]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" {box} role="img" aria-labelledby="{name}-title {name}-about" '
        f'class="plot" stroke-linejoin="round"{_stated(points, panels)}>'
        f'<title id="{name}-title">{html.escape(title)}</title><desc id="{name}-about">{html.escape(about)}</desc>'
    )
    return re.sub(r"<svg[^>]*>", lambda _: head, svg, count=1)


def _stated(points: Sequence[dict[str, Any]], panels: Sequence[dict[str, Any]]) -> str:
    """The attributes that hold the lines and axes of a drawing; none where it has no lines."""
    if not points:
        return ""
    told = {"points": points, "panels": panels}
    texts = {key: json.dumps(value, allow_nan=False, separators=(",", ":")) for key, value in told.items()}
    return "".join(f' data-{key}="{html.escape(text)}"' for key, text in texts.items())


def trend_plot(
    name: str, title: str, about: str, series: Sequence[Series], bar: float, ylabel: str = "part of the bar (%)"
) -> str:
    """Percentages over the number of the run, with the bar as a line, as SVG text."""

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        axes.axhline(bar, color=INK, linewidth=1.2, linestyle=(0, (4, 2)))
        for line in series:
            _line(axes, line)
        axes.set(xlabel="run", ylabel=ylabel)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylim(bottom=0.0)
        _legend(figure, axes)

    return _draw(name, title, about, paint, (SIZE[0], SIZE[1] * 1.1))
