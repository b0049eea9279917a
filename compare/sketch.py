"""Sketch: plan view and section of a scene, true to scale, as one inline SVG."""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup

from compare.scene import Band, Outlined, PointProbe, Rectangle, Scene
from compare.scene_parts import Interval, Load, Support
from compare.scene_rim import Rim
from compare.treads import PREFIX

SIDE = 300.0  # longest side of the plan, in the drawing's units
MARGIN = 46.0
GAP = 48.0
HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w:.0f} {h:.0f}" role="img" class="sketch" '
    'aria-labelledby="sketch-{name}" font-size="12" fill="currentColor"><title id="sketch-{name}">{title}</title>'
)


def sketch(scene: Scene) -> Markup:
    """The scene as an SVG element: supports, loads and probes marked, grooves shaded.

    A clamped edge is hatched, so is one on a rim, with the directions in which it is free; a held edge or corner stands
    on rollers beside the components held, a plane of symmetry is a chain line.
    On a curved mid-surface the plan shows the parameters x and y, scaled to a square at most, and no section.
    """
    (x0, x1), (y0, y1) = scene.surface.span
    flat = isinstance(scene.surface, Rectangle)
    scale = SIDE / max(x1 - x0, y1 - y0) if flat else None
    width, height = (scale * (x1 - x0), scale * (y1 - y0)) if flat else (SIDE, SIDE)
    plan = _Plan((x0, x1), (y0, y1), width, height)
    pieces = [plan.box((x0, x1), (y0, y1), 'fill="none" stroke="currentColor" stroke-width="1.5"')]
    pieces += _bands(scene, plan)
    pieces += [piece for support in scene.supports for piece in _support(plan, support)]
    pieces += _rim(plan, scene.rim)
    pieces += _loads(scene, plan)
    pieces += _probes(scene, plan)
    pieces += _axes(plan, flat)
    total = height + 2 * MARGIN
    if flat and not _outlined(scene):
        pieces += _section(scene, plan, scale)
        total += GAP + scale * scene.thickness
    head = Markup(HEAD).format(
        w=width + 2 * MARGIN + 40, h=total, name=scene.name, title=f"Sketch of the scene: {scene.title}"
    )
    return head + Markup("").join(pieces) + Markup("</svg>")


class _Plan:
    """Plan coordinates: x to the right, y upwards."""

    def __init__(self, x: Interval, y: Interval, width: float, height: float):
        self.x, self.y, self.width, self.height = x, y, width, height

    def place(self, x: float, y: float) -> tuple[float, float]:
        right = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return MARGIN + right * self.width, MARGIN + (1 - up) * self.height

    def edge(self, name: str) -> tuple[tuple[float, float], tuple[float, float]]:
        """The two ends of an edge."""
        if name[0] == "x":
            return tuple(self.place(self.x[int(name[1])], y) for y in self.y)
        return tuple(self.place(x, self.y[int(name[1])]) for x in self.x)

    def box(self, x: Interval, y: Interval, paint: str) -> Markup:
        left, top = self.place(x[0], y[1])
        right, bottom = self.place(x[1], y[0])
        return _rectangle(left, top, right - left, bottom - top, paint)


def _rectangle(left: float, top: float, width: float, height: float, paint: str) -> Markup:
    return Markup(f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" {paint}/>')


def _text(x: float, y: float, words: str, anchor: str = "middle") -> Markup:
    return Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>').format(x, y, anchor, words)


def _outlined(scene: Scene) -> bool:
    """Whether anything on the plate has an outline, which no section shows."""
    return any(isinstance(band, Outlined) for band in (*scene.grooves, *scene.protrusions))


def _bands(scene: Scene, plan: _Plan) -> Iterator[Markup]:
    paint = 'fill="var(--ancf, #0072b2)" fill-opacity="0.22" stroke="var(--ancf, #0072b2)" stroke-dasharray="{}"'
    if _outlined(scene):
        yield Markup(f'<clipPath id="plate-{scene.name}">{plan.box(plan.x, plan.y, "")}</clipPath>')
    for band in (*scene.grooves, *scene.protrusions):
        stroke = paint.format("4 3" if band.face == "bottom" else "none")
        if isinstance(band, Outlined):
            polygon = [plan.place(x, y) for x, y in band.outline.polygon.tolist()]
            path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in polygon) + "Z"
            yield Markup(f'<path d="{path}" clip-path="url(#plate-{scene.name})" {stroke}/>')
            x, y = plan.place(*(sum(band.limits(axis)) / 2 for axis in (0, 1)))
        else:
            extent = band.extent or (plan.x if band.along == "x" else plan.y)
            box = (extent, band.edges) if band.along == "x" else (band.edges, extent)
            yield plan.box(*box, stroke)
            (x0, x1), (y0, y1) = box
            up = NAMED_AT if band.along == "y" else 0.5  # away from the names of bands that cross it
            x, y = plan.place((x0 + x1) / 2, y0 + up * (y1 - y0))
        if not band.name.startswith(PREFIX):
            yield _text(x, y + 4, f"{band.name} ({band.face})")


NAMED_AT = 0.8  # of a band along y
OUTWARD = {"x0": (-9.0, 9.0), "x1": (9.0, 9.0), "y0": (9.0, 9.0), "y1": (9.0, -9.0)}


def _support(plan: _Plan, support: Support) -> Iterator[Markup]:
    if support.kind == "clamp":
        yield _clamp(plan, support.edge)
        return
    if support.kind == "hold" and support.whole:
        middle = plan.place(sum(plan.x) / 2, sum(plan.y) / 2)
        yield _text(middle[0], middle[1] + 16, f"{' '.join(support.components)} held throughout")
        return
    corner = support.kind == "hold" and support.corner is not None
    name = support.corner if corner else support.edge
    ends = [plan.place(plan.x[int(name[1])], plan.y[int(name[3])])] * 2 if corner else plan.edge(name)
    (xa, ya), (xb, yb) = ends
    out_x, out_y = _outward(name)
    words = f"symmetry {support.normal}" if support.kind == "symmetry" else " ".join(support.components)
    if support.kind == "symmetry":
        paint = 'stroke="currentColor" stroke-width="2" stroke-dasharray="14 4 3 4" fill="none"'
        yield Markup(
            f'<path d="M{xa + 5 * out_x:.1f} {ya + 5 * out_y:.1f}L{xb + 5 * out_x:.1f} {yb + 5 * out_y:.1f}" {paint}/>'
        )
    else:
        for i in (0,) if corner else range(7):
            x, y = xa + (xb - xa) * i / 6 + 6 * out_x, ya + (yb - ya) * i / 6 + 6 * out_y
            yield Markup(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="none" stroke="currentColor"/>')
    anchor = {-1.0: "end", 1.0: "start"}.get(out_x, "middle")
    yield _text((xa + xb) / 2 + 14 * out_x, (ya + yb) / 2 + 14 * out_y + 4 + 4 * out_y, words, anchor)


def _outward(name: str) -> tuple[float, float]:
    """Direction away from the plate at an edge, of a corner that of its y edge, in the drawing."""
    return {"x0": (-1.0, 0.0), "x1": (1.0, 0.0), "y0": (0.0, 1.0), "y1": (0.0, -1.0)}[name[-2:]]


def _clamp(plan: _Plan, edge: str) -> Markup:
    """Hatching outside a clamped edge."""
    outward = OUTWARD[edge]
    (xa, ya), (xb, yb) = plan.edge(edge)
    count = 18
    ticks = [
        f"M{xa + (xb - xa) * i / count:.1f} {ya + (yb - ya) * i / count:.1f}l{outward[0]:.0f} {outward[1]:.0f}"
        for i in range(count + 1)
    ]
    path = f"M{xa:.1f} {ya:.1f}L{xb:.1f} {yb:.1f}"
    return Markup(f'<path d="{path}" stroke="currentColor" stroke-width="3"/>') + Markup(
        f'<path d="{"".join(ticks)}" stroke="currentColor" stroke-width="1" fill="none"/>'
    )


def _rim(plan: _Plan, rim: Rim | None) -> Iterator[Markup]:
    for edge in () if rim is None else rim.edges:
        yield _clamp(plan, edge)
        (xa, ya), (xb, yb) = plan.edge(edge)
        out_x, out_y = _outward(edge)
        words = f"rim, free along {' '.join(rim.free)}" if rim.free else "rim"
        anchor = {-1.0: "end", 1.0: "start"}.get(out_x, "middle")
        yield _text((xa + xb) / 2 + 14 * out_x, (ya + yb) / 2 + 20 * out_y + 4, words, anchor)


def _loads(scene: Scene, plan: _Plan) -> Iterator[Markup]:
    """Loads that have a place, each with its largest component."""
    colour = "var(--reference, #d55e00)"
    paint = f'fill="{colour}" fill-opacity="0.35" stroke="{colour}"'
    for load in scene.loads:
        if load.kind == "patch":
            yield plan.box(*load.region, paint)
            x, y = plan.place(load.region[0][1], load.region[1][1])
        elif load.kind == "point":
            x, y = plan.place(*load.at)
            yield Markup(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="8" {paint}/>')
        elif load.kind in ("edge", "moment"):
            (xa, ya), (x, y) = plan.edge(load.edge)
            yield Markup(f'<path d="M{xa:.1f} {ya:.1f}L{x:.1f} {y:.1f}" stroke="{colour}" stroke-width="5"/>')
        elif load.kind == "pressure":
            x, y = plan.place(sum(plan.x) / 2, sum(plan.y) / 2)
        else:
            continue
        yield _text(x, y - 13, _size(load).replace("-", "\u2212"))


def _size(load: Load) -> str:
    """A load's largest component in words."""
    if load.kind == "pressure":
        return f"{load.pressure:+g} Pa on the {load.face}"
    if load.kind == "moment":
        return f"{max(load.moment, key=abs):+g} N m"
    return f"{max(load.force, key=abs):+g} N"


def _probes(scene: Scene, plan: _Plan) -> Iterator[Markup]:
    for probe in scene.probes:
        if isinstance(probe, PointProbe):
            x, y = plan.place(*probe.at[:2])
            yield Markup(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3"/>')
        else:
            x, y = plan.place(*(sum(side) / 2 for side in probe.region))
        yield _text(x + 12, y + 16, probe.name, "start")


def _axes(plan: _Plan, flat: bool) -> Iterator[Markup]:
    x, y = plan.place(plan.x[0], plan.y[0])
    unit = " m" if flat else ""
    yield _text(x + plan.width / 2, y + 24, f"x: {plan.x[0]:g} to {plan.x[1]:g}{unit}")
    words = _text(0, 0, f"y: {plan.y[0]:g} to {plan.y[1]:g}{unit}")
    yield Markup(f'<g transform="translate({x - 18:.1f} {y - plan.height / 2:.1f}) rotate(-90)">{words}</g>')


def _section(scene: Scene, plan: _Plan, scale: float) -> Iterator[Markup]:
    """Cross-section along y, seen along x; rectangular and profiled bands that run along x."""
    top, left = MARGIN + plan.height + GAP, MARGIN
    thick = scale * scene.thickness
    width = scale * (plan.y[1] - plan.y[0])
    outline = {face: [(left, 0.0), (left + width, 0.0)] for face in ("top", "bottom")}
    for sign, bands in ((1.0, scene.grooves), (-1.0, scene.protrusions)):
        for band in bands:
            if band.along == "x":
                outline[band.face] += [(left + scale * (a - plan.y[0]), sign * scale * d) for a, d in _profile(band)]
    upper = [(x, top + d) for x, d in sorted(outline["top"], key=lambda p: p[0])]
    lower = [(x, top + thick - d) for x, d in sorted(outline["bottom"], key=lambda p: p[0])]
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in upper + lower[::-1]) + "Z"
    yield Markup(f'<path d="{path}" fill="currentColor" fill-opacity="0.14" stroke="currentColor"/>')
    label = f"section across x, thickness {scene.thickness:g} m (to scale)"
    yield _text(left + width / 2, top + thick + 20, label)


def _profile(band: Band) -> list[tuple[float, float]]:
    """Corners (across, depth) of a band's section; of a NURBS profile its control polygon."""
    if band.profile is not None:
        return list(band.profile.control_points)
    a, b = band.across
    return [(a, 0.0), (a, band.depth), (b, band.depth), (b, 0.0)]
