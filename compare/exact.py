"""Closed-form and published values: the third opinion, so that two solvers agreeing is not the only evidence.

Kinds: "exact" (a closed form evaluated here), "published" (printed in the cited source) and
"cross-code" (computed by a code nobody here wrote, on the mesh that is named).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

if TYPE_CHECKING:
    from compare.scene import Scene

BISSHOPP_DRUCKER = "Bisshopp and Drucker, Q. Appl. Math. 3 (1945) 272: inextensible elastica, dead end force"
CALCULIX = "CalculiX 2.20, St. Venant-Kirchhoff (*ELASTIC, NLGEOM), undamped Newmark (*DYNAMIC, ALPHA=0)"


@dataclass(frozen=True)
class Value:
    """A number to be judged against: value and unit, kind, source, and the cell or model it came from.

    mesh: elements along x and y of the printed row, where it belongs to one.
    """

    name: str
    value: float
    unit: str
    kind: str
    source: str
    cell: str = ""
    mesh: tuple[int, int] | None = None


def published(scene: Scene) -> tuple[Value, ...]:
    """Printed heights (m) of the scene's answer probe: one per mesh, then the converged one."""
    stated = scene.published
    if stated is None:
        return ()
    rows = [Value("height", r.value, "m", "published", stated.source, r.cell, r.mesh) for r in stated.rows]
    if stated.converged is not None:
        rows.append(Value("height", stated.converged.value, "m", "published", stated.source, stated.converged.cell))
    return tuple(rows)


def elastica_end_shear(load: float) -> tuple[float, float, float]:
    """Cantilever with a dead transverse end force, load = P L^2 / (E I) > 0.

    Returns (deflection / L, shortening / L, rotation of the end in rad). With modulus k of the elliptic
    integrals, k^2 = (1 + sin theta) / 2 and sin phi = 1 / (k sqrt 2):
    sqrt(load) = K(k) - F(phi, k), deflection / L = 1 - 2 (E(k) - E(phi, k)) / sqrt(load),
    (L - shortening)^2 / L^2 = 2 sin theta / load (Bisshopp and Drucker 1945).
    """
    if not load > 0:
        raise ValueError(f"the elastica's load must be positive, got {load}")

    def length(theta: float) -> float:
        m, phi = _modulus(theta)
        return ellipk(m) - ellipkinc(phi, m)

    upper = np.pi / 2
    theta = brentq(lambda angle: length(angle) - np.sqrt(load), 0.0, upper * (1 - 1e-13), xtol=1e-15, rtol=1e-14)
    m, phi = _modulus(theta)
    deflection = 1 - 2 * (ellipe(m) - ellipeinc(phi, m)) / np.sqrt(load)
    return float(deflection), float(1 - np.sqrt(2 * np.sin(theta) / load)), float(theta)


def reentrant_order(angle: float) -> float:
    """Order in h of an energy or compliance at a free re-entrant edge whose material fills `angle` (rad, pi to 2 pi).

    Stress grows like r^(lambda - 1) there, lambda the least positive root of
    sin(lambda angle) = -lambda sin(angle), and the energy error of uniformly refined elements of any
    degree falls like h^(2 lambda) (Williams, J. Appl. Mech. 19 (1952) 526; Strang and Fix, chapter 8).
    1.0890 at the floor of a rectangular groove (angle 3 pi / 2), 1 at a crack.
    """
    if not np.pi < angle <= 2 * np.pi:
        raise ValueError(f"a re-entrant edge has an angle above pi and up to 2 pi, got {angle}")
    return 2 * brentq(lambda x: np.sin(x * angle) + x * np.sin(angle), 0.5 - 1e-9, 1 - 1e-9, xtol=1e-14)


def _modulus(theta: float) -> tuple[float, float]:
    """Parameter m = k^2 and amplitude phi of the elliptic integrals for an end rotation theta (rad)."""
    m = (1 + np.sin(theta)) / 2
    return m, np.arcsin(np.minimum(1.0, 1 / np.sqrt(2 * m)))


def elastica_end_moment(moment: float) -> tuple[float, float, float]:
    """Cantilever with an end moment, moment = M L / (E I) != 0: it bends to an arc of angle `moment`.

    Returns (deflection / L, shortening / L, rotation of the end in rad).
    """
    return float((1 - np.cos(moment)) / moment), float(1 - np.sin(moment) / moment), float(moment)


def beam_deflection(force: float, length: float, width: float, thickness: float, youngs_modulus: float) -> float:
    """End deflection (m) of an Euler-Bernoulli cantilever under a small transverse end force (N): P L^3 / (3 E I)."""
    return force * length**3 / (3 * youngs_modulus * width * thickness**3 / 12)


def beam_frequency(mode: int, length: float, thickness: float, youngs_modulus: float, density: float) -> float:
    """Bending frequency (Hz) of an Euler-Bernoulli cantilever, mode = 1, 2, ...: cos(b) cosh(b) = -1."""
    b = brentq(lambda b: np.cos(b) + 1 / np.cosh(b), (mode - 1) * np.pi + 1e-9, mode * np.pi, xtol=1e-14)
    return float(b**2 / (2 * np.pi * length**2) * thickness * np.sqrt(youngs_modulus / (12 * density)))


def tube_pressure(stretch: float, ratio: float) -> float:
    """Pressure over mu that blows an incompressible neo-Hooke tube in plane strain up to `stretch` on its inside.

    ratio: outer over inner radius at rest. In plane strain a Mooney-Rivlin tube is the same but for its mu (Ogden,
    Non-Linear Elastic Deformations, 1984, section 5.3): p = [ln l - 1 / (2 l^2)] from the outer stretch to the inner.

        >>> round(tube_pressure(2.0, 2.0), 8)  # the published table
        0.57405357
    """
    outer = np.sqrt(1 + (stretch**2 - 1) / ratio**2)
    return float(np.log(stretch / outer) - (stretch**-2 - outer**-2) / 2)


def sphere_pressure(stretch: float, ratio: float, mu10: float, mu01: float) -> float:
    """Pressure that blows an incompressible Mooney-Rivlin sphere up to `stretch` on its inside (Ogden 1984, 5.3).

    ratio: outer over inner radius at rest. p is the integral of W' / (l^3 - 1) from the outer stretch to the inner,
    W = mu10 (2 l^2 + l^-4 - 3) + mu01 (l^4 + 2 l^-2 - 3).

        >>> round(sphere_pressure(1.5, 2.0, 0.5, 0.0), 8), round(sphere_pressure(1.5, 2.0, 0.4375, 0.0625), 8)
        (0.75543312, 0.81292914)
    """
    outer = (1 + (stretch**3 - 1) / ratio**3) ** (1 / 3)

    def part(x: float) -> float:
        return -mu10 * (4 / x + 1 / x**4) + mu01 * (4 * x - 2 / x**2)

    return float(part(stretch) - part(outer))


def annulus_deflection(hole: float, nu: float, clamped: bool) -> float:
    """w D / (p R^4) on the rim of a free hole of radius `hole` R in a Kirchhoff disc under uniform pressure.

    Its edge is clamped or simply supported. w = r^4 / 64 + A + B r^2 + C ln r + E r^2 ln r in units of R and p / D;
    without a hole 1/64 and (5 + nu) / (64 (1 + nu)) (Timoshenko and Woinowsky-Krieger, Theory of Plates and
    Shells, chapter 3).
    """

    def terms(r: float) -> np.ndarray:
        """Deflection, slope, radial moment and shear force of 1, r^2, ln r, r^2 ln r and r^4 / 64."""
        log = np.log(r)
        w = [1.0, r**2, log, r**2 * log, r**4 / 64]
        slope = [0.0, 2 * r, 1 / r, 2 * r * log + r, r**3 / 16]
        second = [0.0, 2.0, -1 / r**2, 2 * log + 3, 3 * r**2 / 16]
        shear = [0.0, 0.0, 0.0, 4 / r, r / 2]
        return np.array([w, slope, np.add(second, nu * np.array(slope) / r), shear])

    rim, edge = terms(hole), terms(1.0)
    conditions = np.stack([rim[2], rim[3], edge[0], edge[1] if clamped else edge[2]])
    amplitudes = np.linalg.solve(conditions[:, :4], -conditions[:, 4])
    return float(rim[0] @ [*amplitudes, 1.0])


PLAIN = ()
PAIR = (("bottom", "x", 0.2, 0.3, 0.03), ("bottom", "x", 0.7, 0.8, 0.03))
CENTRAL = (("bottom", "x", 0.4, 0.6, 0.02),)

# (analysis, grooves) -> (mesh and element, time step, height of the corner at the end in m); 50 N on the corner edge
CALCULIX_HEIGHTS = {
    ("dynamic", PLAIN): (
        ("C3D20 5x5x1", 0.01, -0.49576),
        ("C3D20 10x10x1", 0.01, -0.49947),
        ("C3D20 10x10x2", 0.01, -0.49986),
        ("C3D20 20x20x1", 0.01, -0.50065),
        ("C3D20R 10x10x1", 0.01, -0.50067),
        ("C3D10 h=0.1", 0.01, -0.49940),
        ("C3D10 h=0.06", 0.01, -0.50061),
    ),
    ("dynamic", CENTRAL): (
        ("C3D20 10x10x1", 0.01, -0.54890),
        ("C3D10 h=0.1", 0.01, -0.54805),
        ("C3D10 h=0.06", 0.01, -0.55016),
    ),
    ("dynamic", PAIR): (
        ("C3D20 10x10", 0.02, -0.56234),
        ("C3D20 20x20", 0.02, -0.56526),
        ("C3D20R 20x20", 0.02, -0.56596),
    ),
    ("static", PLAIN): (("C3D20 20x20x2", None, -0.63341), ("C3D10 h=0.06", None, -0.63328)),
    ("static", CENTRAL): (("C3D20 20x20x1", None, -0.66762), ("C3D10 h=0.06", None, -0.66741)),
}


def cross_code(scene: Scene) -> tuple[Value, ...]:
    """Heights (m) of the free corner that CalculiX found for the scene's own question; empty for any other question."""
    if not _is_the_cantilever(scene):
        return ()
    straight = (band for band in scene.grooves if not hasattr(band, "outline") and band.profile is None)
    cut = tuple((band.face, band.along, *band.edges, band.depth) for band in straight)
    if len(cut) < len(scene.grooves) or scene.protrusions:
        return ()
    found = CALCULIX_HEIGHTS.get((scene.analysis.kind, cut), ())
    return tuple(
        Value("height", height, "m", "cross-code", CALCULIX, mesh if step is None else f"{mesh}, time step {step} s")
        for mesh, step, height in found
    )


def _is_the_cantilever(scene: Scene) -> bool:
    """Whether all but the grooves is what CalculiX was asked: plate, clamp and corner force of section 7.2."""
    stated = scene.physics()
    return (
        stated["surface"] == {"kind": "rectangle", "length": 1.0, "width": 1.0}
        and stated["thickness"] == 0.05
        and stated["material"] == {"kind": "svk", "youngs_modulus": 2e6, "poissons_ratio": 0.0, "density": 2000.0}
        and [(clamp.kind, clamp.edge) for clamp in scene.supports] == [("clamp", "x0")]
        and [(load["kind"], load.get("at"), load.get("force")) for load in stated["loads"]]
        == [("point", [1.0, 1.0], [0.0, 0.0, -50.0])]
        and stated["loads"][0]["history"] == [[0.0, 0.0], [1.0, 1.0]]
        and stated["initial"] is None
        and stated["analysis"]["until"] == 1.0
        and stated["probes"][0].get("at") == [1.0, 1.0, 0.0]
    )
