"""Pictures of meshes, groove sections and deformed shapes, rendered off screen; the only pyvista.

VTK ends the whole process where no OpenGL library can be loaded. The pictures are therefore rendered
in a process of its own (`python -m compare.figures`): when that one dies, the pictures are missing, the
reason is known, and everything else goes on.
"""

from __future__ import annotations

import io
import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.result import Outline

WINDOW = (1400, 900)
FACE = {"ancf": "#a9cbe3", "reference": "#f0c9ab"}
LINE = "#26313b"
MAP = "cividis"
TIMEOUT = 180.0  # s for all pictures of a page


@dataclass(frozen=True)
class Job:
    """A picture to make of an outline.

    view: "mesh" (undeformed, with mesh lines), "section" (its part within `radius` (m) of `centre` (m),
    seen along the plate), "deformed" (displaced `times` as far as it is, coloured by the size of the
    displacement from 0 to `greatest` (m)) or "mode" (the same of a shape of vibration, whose size means nothing).
    below: seen from below instead of from above.
    """

    name: str
    caption: str
    view: str
    solver: str
    outline: Outline
    below: bool = False
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0
    greatest: float = 0.0
    times: float = 1.0


@dataclass(frozen=True)
class Picture:
    """A PNG with its caption. `scale` is (least, greatest, unit) of the colours, None where they mean nothing."""

    name: str
    caption: str
    png: bytes
    width: int
    height: int
    scale: tuple[float, float, str] | None = None


def render(jobs: Sequence[Job]) -> tuple[list[Picture], str]:
    """The pictures that could be made, in order, and why others could not ("" when all could)."""
    command = [sys.executable, "-m", "compare.figures"]
    try:
        run = subprocess.run(command, input=pickle.dumps(list(jobs)), capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as error:
        return _pictures(error.stdout or b""), f"rendering took more than {TIMEOUT:.0f} s"
    return _pictures(run.stdout), _reason(run)


def _pictures(stream: bytes) -> list[Picture]:
    """Every whole picture in what the rendering process wrote."""
    file, made = io.BytesIO(stream), []
    while True:
        try:
            made.append(pickle.load(file))
        except (EOFError, pickle.UnpicklingError):
            return made


def _reason(run: subprocess.CompletedProcess[bytes]) -> str:
    if run.returncode == 0:
        return ""
    if run.returncode < 0:
        return f"VTK was ended by signal {-run.returncode}: OpenGL libraries such as libgl1 and libegl1 may be missing"
    said = run.stderr.decode(errors="replace").strip().splitlines()
    return said[-1] if said else f"the rendering process ended with exit code {run.returncode}"


def main() -> int:
    """Render the jobs on standard input; each picture goes to standard output as soon as it is made."""
    pictures = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    for job in pickle.load(sys.stdin.buffer):
        pickle.dump(picture(job), pictures)
        pictures.flush()
    return 0


def picture(job: Job) -> Picture:
    """Render one job in this process."""
    plotter = _plotter()
    outline, points = job.outline, np.asarray(job.outline.points, float)
    if job.view in ("deformed", "mode"):
        moved = points + job.times * outline.displacement
        _lines(plotter, _feature_edges(outline, points), "#8b959e", 2.0)
        _add_body(plotter, outline, moved, np.linalg.norm(outline.displacement, axis=1), job.greatest)
        _look(plotter, np.vstack([points, moved]), below=False)
        return _shoot(
            plotter, job, (0.0, job.greatest, "m") if job.view == "deformed" else (0.0, 1.0, "of the largest")
        )
    _add_body(plotter, outline, points, FACE[job.solver], line_width=3.0 if job.view == "section" else 2.0)
    if job.view == "section":
        _approach(plotter, np.array(job.centre), job.radius, job.below)
    else:
        _look(plotter, points, job.below)
    return _shoot(plotter, job)


def _plotter():
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkRenderingCore import vtkMapper

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
    plotter = pyvista.Plotter(off_screen=True, window_size=WINDOW)
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _add_body(plotter, outline: Outline, points: np.ndarray, paint, greatest: float = 0.0, line_width: float = 1.6):
    """Draw an outline placed at `points` (n, 3): paint is a colour, or lengths (n,) coloured from 0 to `greatest`."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(points, outline.triangles)
    look = {"color": paint} if isinstance(paint, str) else {"scalars": paint, "clim": (0.0, greatest), "cmap": MAP}
    plotter.add_mesh(surface, show_scalar_bar=False, ambient=0.3, diffuse=0.75, **look)
    if len(outline.edges):
        cells = np.insert(np.asarray(outline.edges), 0, 2, axis=1)
        _lines(plotter, pyvista.PolyData(points, lines=cells), LINE, line_width, opacity=0.7)
    _lines(plotter, _feature_edges(outline, points), LINE, 1.5 * line_width)


def _feature_edges(outline: Outline, points: np.ndarray):
    """Edges where neighbouring triangles meet at more than 30 degrees; points that coincide are one."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(points, outline.triangles).clean(tolerance=1e-9)
    surface = surface.compute_normals(consistent_normals=True, split_vertices=False)
    return surface.extract_feature_edges(30.0, non_manifold_edges=False)


def _lines(plotter, lines, colour: str, width: float, opacity: float = 1.0) -> None:
    if lines.n_cells:
        plotter.add_mesh(lines, color=colour, line_width=width, opacity=opacity, lighting=False)


def _look(plotter, points: np.ndarray, below: bool) -> None:
    """Camera that sees all points from the free end, above or below."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre, reach = (low + high) / 2, np.linalg.norm(high - low)
    _camera(plotter, centre, reach * np.array([1.0, -1.6, 0.95]), 0.37 * reach, below)


def _approach(plotter, centre: np.ndarray, radius: float, below: bool) -> None:
    """Camera close to `centre`, looking along the plate from its end."""
    _camera(plotter, centre, radius * np.array([6.0, -1.7, 2.2]), radius, below)


def _camera(plotter, centre: np.ndarray, offset: np.ndarray, scale: float, below: bool) -> None:
    up = -1.0 if below else 1.0
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + offset * (1.0, up, up)
    plotter.camera.up = (0.0, 0.0, up)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = scale
    plotter.reset_camera_clipping_range()


def _shoot(plotter, job: Job, scale: tuple[float, float, str] | None = None) -> Picture:
    """Render, trim the empty margin and store as PNG with a transparent background."""
    from PIL import Image

    image = Image.fromarray(plotter.screenshot(return_img=True, transparent_background=True))
    plotter.close()
    image = image.crop((2, 2, image.width - 2, image.height - 2))  # the outermost rows may carry stray samples
    image = image.crop(image.getchannel("A").getbbox() or (0, 0, *image.size))
    if scale is None:
        image = image.quantize(200, method=Image.Quantize.FASTOCTREE)
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return Picture(job.name, job.caption, file.getvalue(), *image.size, scale)


if __name__ == "__main__":
    # Unpickle the classes as those that the parent knows, not as __main__'s.
    from compare.figures import main as run

    sys.exit(run())
