"""Pictures of meshes, groove sections and deformed shapes, rendered off screen; the only pyvista.

VTK ends the whole process where no OpenGL library can be loaded, so a throw-away process tries first
(`rendering_problem`), and pyvista is imported only after it has succeeded.
"""

from __future__ import annotations

import functools
import io
import subprocess
import sys
from dataclasses import dataclass

import numpy as np

from compare.result import Outline

WINDOW = (1100, 700)
FACE = {"ancf": "#a9cbe3", "reference": "#f0c9ab"}
LINE = "#26313b"
MAP = "cividis"
PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(40, 40))
plotter.add_mesh(pyvista.Sphere())
plotter.screenshot(return_img=True)
"""


@dataclass(frozen=True)
class Picture:
    """A PNG with its caption. `scale` is (least, greatest, unit) of the colours, None where they mean nothing."""

    name: str
    caption: str
    png: bytes
    width: int
    height: int
    scale: tuple[float, float, str] | None = None


@functools.cache
def rendering_problem() -> str | None:
    """Why no picture can be rendered here, or None; found by rendering a sphere in a process of its own."""
    try:
        run = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, timeout=120)
    except subprocess.TimeoutExpired:
        return "the trial rendering did not end within 120 s"
    if run.returncode == 0:
        return None
    if run.returncode < 0:
        return f"VTK was ended by signal {-run.returncode} (OpenGL libraries such as libgl1 and libegl1 are missing)"
    said = run.stderr.strip().splitlines()
    return said[-1] if said else f"the trial rendering ended with exit code {run.returncode}"


def mesh_picture(name: str, caption: str, solver: str, outline: Outline, face: str = "bottom") -> Picture:
    """The undeformed body with its mesh lines, seen from the side of `face`."""
    plotter = _plotter()
    _add_body(plotter, outline, outline.points, FACE[solver])
    _look(plotter, outline.points, from_below=face == "bottom")
    return _shoot(plotter, name, caption)


def section_picture(
    name: str, caption: str, solver: str, outline: Outline, centre: np.ndarray, radius: float, face: str
) -> Picture:
    """Close-up of the undeformed body within `radius` (m) of `centre` (3,), along -X and from the side of `face`."""
    plotter = _plotter()
    _add_body(plotter, outline, outline.points, FACE[solver], line_width=1.6)
    up = -1.0 if face == "bottom" else 1.0
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + radius * np.array([3.0, 1.3, 1.2 * up])
    plotter.camera.up = (0.0, 0.0, up)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = radius
    plotter.reset_camera_clipping_range()
    return _shoot(plotter, name, caption)


def deformed_picture(name: str, caption: str, outline: Outline, greatest: float) -> Picture:
    """The deformed body coloured by the magnitude of its displacement from 0 to `greatest` (m)."""
    plotter = _plotter()
    moved = outline.points + outline.displacement
    size = np.linalg.norm(outline.displacement, axis=1)
    _add_body(plotter, outline, outline.points, "#9aa4ad", opacity=0.18, lines=False)
    _add_body(plotter, outline, moved, scalars=size, clim=(0.0, greatest))
    _look(plotter, np.vstack([outline.points, moved]), from_below=False)
    return _shoot(plotter, name, caption, (0.0, greatest, "m"))


def _plotter():
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    plotter = pyvista.Plotter(off_screen=True, window_size=WINDOW)
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _add_body(
    plotter,
    outline: Outline,
    points: np.ndarray,
    colour=None,
    scalars=None,
    clim=None,
    line_width=1.1,
    opacity=1.0,
    lines=True,
) -> None:
    """Draw triangles (flat or coloured by `scalars` (n,)) and mesh lines of an outline placed at `points` (n, 3)."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(np.asarray(points, float), outline.triangles)
    paint = {"color": colour} if scalars is None else {"scalars": scalars, "clim": clim, "cmap": MAP}
    plotter.add_mesh(surface, show_scalar_bar=False, opacity=opacity, ambient=0.35, diffuse=0.7, **paint)
    if lines and len(outline.edges):
        cells = np.insert(outline.edges, 0, 2, axis=1)
        plotter.add_mesh(pyvista.PolyData(np.asarray(points, float), lines=cells), color=LINE, line_width=line_width)


def _look(plotter, points: np.ndarray, from_below: bool) -> None:
    """Camera that sees all points from the free end, above or below."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = (low + high) / 2, np.linalg.norm(high - low)
    up = -1.0 if from_below else 1.0
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + reach * np.array([1.0, -1.6, 0.95 * up])
    plotter.camera.up = (0.0, 0.0, up)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.36 * reach
    plotter.reset_camera_clipping_range()


def _shoot(plotter, name: str, caption: str, scale: tuple[float, float, str] | None = None) -> Picture:
    """Render, trim the empty margin and store as a palette PNG with a transparent background."""
    from PIL import Image

    image = Image.fromarray(plotter.screenshot(return_img=True, transparent_background=True))
    plotter.close()
    image = image.crop(image.getchannel("A").getbbox() or (0, 0, *image.size))
    file = io.BytesIO()
    image.quantize(160, method=Image.Quantize.FASTOCTREE).save(file, "PNG", optimize=True)
    return Picture(name, caption, file.getvalue(), *image.size, scale)
