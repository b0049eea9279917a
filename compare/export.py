"""A result for ParaView: its surface with displacement and stress at the nodes, as VTU, VTK or XDMF."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np

from compare.files import replacing, write_text
from compare.result import Result

FORMATS = (".vtu", ".vtk", ".xdmf")


class ExportError(ValueError):
    """A result that cannot be exported; the message says why."""


def write(result: Result, path: Path) -> None:
    """Write the surface of a result; "Warp By Vector" shows it bent. Raises ExportError."""
    if result.outline is None:
        raise ExportError(f"{path}: the result of {result.solver} has no surface ({result.status})")
    if path.suffix not in FORMATS:
        raise ExportError(f"{path}: wanted a name that ends with one of {', '.join(FORMATS)}")
    if path.suffix == ".xdmf":
        write_text(path, xdmf(result))
        return
    import meshio

    mesh = meshio.Mesh(result.outline.points, [("triangle", result.outline.triangles)], fields(result))
    with replacing(path) as file:
        meshio.write(file.name, mesh, file_format=path.suffix[1:])


def fields(result: Result) -> dict[str, np.ndarray]:
    """Fields at the nodes: "displacement" (n, 3) in m and, where the result has it, "von_mises" (n,) in Pa; or each
    mode (n, 3) scaled to the largest displacement 1. No name has a space, which VTK does not allow.
    """
    outline = result.outline
    if outline.modes is None:
        stress = {} if outline.stress is None else {"von_mises": outline.stress}
        return {"displacement": outline.displacement, **stress}
    return {
        f"mode_{i}_{hertz:.6g}_Hz": mode
        for i, (hertz, mode) in enumerate(zip(result.frequencies, outline.modes, strict=True), 1)
    }


def xdmf(result: Result) -> str:
    """The surface as XDMF 3 with its numbers inside, which needs no second file."""
    points, triangles = np.asarray(result.outline.points), np.asarray(result.outline.triangles)
    name = html.escape(str(result.scene.get("name", "scene")))
    attributes = "\n".join(
        f'<Attribute Name="{html.escape(title)}" AttributeType="{"Vector" if values.ndim == 2 else "Scalar"}" '
        f'Center="Node">\n'
        f"{_item(values, 'Float', 8)}\n</Attribute>"
        for title, values in fields(result).items()
    )
    return (
        '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n'
        f'<Grid Name="{name}" GridType="Uniform">\n'
        f'<Topology TopologyType="Triangle" NumberOfElements="{len(triangles)}">\n'
        f"{_item(triangles, 'Int', 8)}\n</Topology>\n"
        f'<Geometry GeometryType="XYZ">{_item(points, "Float", 8)}</Geometry>\n{attributes}\n'
        "</Grid></Domain></Xdmf>\n"
    )


def _item(values: np.ndarray, kind: str, size: int) -> str:
    rows = "\n".join(" ".join(map(repr, row)) for row in np.reshape(values, (len(values), -1)).tolist())
    shape = " ".join(map(str, np.shape(values)))
    return f'<DataItem Dimensions="{shape}" NumberType="{kind}" Precision="{size}" Format="XML">\n{rows}\n</DataItem>'
