"""What each omission on the tire saves, measured: plain elements, repeated ones, and points far from the ground."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from compare.report import Block, Column, Table
from reports.hard_cases.chapter import Asked, Outcome
from reports.speed_profile import replaced
from reports.timing import least
from reports.tire.kernels import grouped, seconds
from reports.tire.scenes import stated, tire

RUN = "tire.savings"
RATE = 1000.0  # 1/s: velocities are this times the way of a step
SEAM = 1e-7  # m: depth of grooves that take nothing, and divide elements like those that do


def units() -> list[Asked]:
    """What is run."""
    return [Asked(f"{RUN}.{name}", {"mesh": [12, 5]}) for name in ("divided", "repeated", "searched")]


def divided(mesh: list[int], **told: Any) -> dict[str, Any]:
    """Elements without a groove have no subdomains: the tangent of the tire, and of one whose every element is divided
    as a grooved one is, by grooves without depth."""
    from ancf.unpack import build

    everywhere = _everywhere(mesh)
    own = {}
    for name, grooves in (("with", None), ("without", everywhere)):
        more = {} if grooves is None else {"grooves": [*stated()["grooves"], *grooves]}
        model = build(*tire({"mesh": mesh, **told}, **more))
        Q, elements = model.system.assembly.gather(model.mesh.vectors.ravel()), model.body.elements
        own[name] = seconds(*grouped(elements, Q))[1]
    return _told("elements without a groove have no subdomains", "tangent of the quarter", own)


def _everywhere(mesh: list[int]) -> list[dict[str, Any]]:
    """A groove around the tire in each row of elements that has none of the scene's, with as many corners."""
    first, last = (stated()["surface"]["section"]["knots"][k] for k in (0, -1))
    lines = np.linspace(first, last, mesh[1] + 1)
    taken = [[point[0] for point in groove["profile"]["control_points"]] for groove in stated()["grooves"]]
    found = []
    for k, (low, high) in enumerate(pairwise(lines)):
        if not any(low < place < high for places in taken for place in places):
            at = low + (high - low) * np.array([0.2, 0.3, 0.7, 0.8])
            points = [[float(y), SEAM if 0 < i < 3 else 0.0] for i, y in enumerate(at)]
            profile = {"degree": 1, "knots": [0, 0, 1, 2, 3, 3], "control_points": points}
            found.append({"name": f"none {k}", "face": "top", "along": "x", "profile": profile})
    return found


def repeated(mesh: list[int], **told: Any) -> dict[str, Any]:
    """Elements around the tire that see the same grooves are integrated once: building it, and each on its own."""
    from ancf import system
    from ancf.unpack import build

    scene, level = tire({"mesh": mesh, **told})
    build(scene, level)
    own = {"with": least(lambda: build(scene, level))}
    with replaced({(system, "sharing"): _alone}):
        own["without"] = least(lambda: build(scene, level))
    return _told("elements that see equal grooves are integrated once", "building the quarter", own)


def _alone(mesh, bands, free=(), own=()):
    """A form for each element."""
    from ancf.parity import NONE
    from ancf.sharing import Sharing

    every = np.arange(len(mesh.cells))
    return Sharing(every, every, np.zeros_like(every), own, (NONE,) * len(every))


def searched(mesh: list[int], **told: Any) -> dict[str, Any]:
    """Points that nothing brings to the ground in a step: an iteration's balance of forces, pressed a millimetre."""
    import ancf.contact
    from ancf.unpack import build

    acting = build(*tire({"mesh": mesh, **told}, height=0.0)).system
    down = np.where((acting.body.mesh.kinds == "r")[:, None], [0.0, 0.0, -0.001], 0.0).ravel()
    begin = acting.body.mesh.vectors.ravel()
    own = {}
    for name, ahead in (("with", ancf.contact.AHEAD), ("without", np.inf)):
        (meeting,) = acting.contact.at_end(begin, acting.contact.untouched(), -RATE * begin, RATE, 1 / RATE).meetings
        _reaching(meeting, begin + down, ahead)
        own[name] = least(lambda own=meeting: (acting.force_internal(begin + down), own.answer(begin + down)))
    return _told("points that cannot reach the ground in a step are not searched", "the balance of an iteration", own)


def _reaching(meeting, q: np.ndarray, ahead: float) -> None:
    """Let a meeting look at the points within `ahead` times the way to q."""
    import ancf.contact

    with replaced({(ancf.contact, "AHEAD"): ahead}):
        meeting.reach(q)


def _told(what: str, where: str, own: dict[str, float]) -> dict[str, Any]:
    with_it, without = own["with"], own["without"]
    return {"what": what, "where": where, "with": with_it, "without": without, "saved": 100 * (1 - with_it / without)}


COLUMNS = (
    Column("what", "omission", "wrap"),
    Column("where", "of", "wrap"),
    Column("without", "CPU without it", ".4f", "s"),
    Column("with", "with it", ".4f", "s"),
    Column("saved", "saved", ".1f", "%"),
    Column("status", "status"),
)


def blocks(outcomes: Sequence[Outcome]) -> list[Block]:
    """The table of omissions."""
    rows = [{c.key: o.get(c.key) for c in COLUMNS} | {"status": o.measured.status} for o in outcomes]
    return [Table("Other omissions, each measured on the quarter of 24 x 10 elements.", COLUMNS, rows)]
