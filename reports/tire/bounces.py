"""What the long run of the fall is judged by: it lasts, it makes no energy, and what the contact takes is accounted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.verdict import Figure, at_least, at_most
from reports.hard_cases.chapter import Outcome

SECONDS, BOUNCES = 2.0, 3  # "2 s, several bounces"
DRIFT = 0.5  # %, as for the fall


def figures(outcomes: Sequence[Outcome]) -> list[Figure]:
    """The worst of the long runs."""
    good = [o for o in outcomes if o.ok and o.get("times")]
    reached = min((o.get("reached") for o in good), default=None)
    bounced = min((bounces(o) for o in good), default=None)
    rises = max((o.get("energy_gain") for o in good), default=None)
    lost = max((unaccounted(o) for o in good), default=None)
    note = "" if not good else f"{good[0].get('dissipated'):,.0f} J by the ground's dampers and friction."
    against = "closed form: constant"
    return [
        at_least("long_seconds", "Time that the long run lasts", reached, "s", SECONDS, against="asked"),
        at_least("long_bounces", "How often the tire leaves the ground in it", bounced, "", BOUNCES, against="asked"),
        at_most(
            "long_gain_percent", "Rise of its energy, in percent of the fall's", rises, "%", DRIFT, against=against
        ),
        at_most(
            "long_lost_percent",
            "What the energy has lost at the end beside what the contact took, in percent of that",
            lost,
            "%",
            DRIFT,
            against=against,
            note=note,
        ),
    ]


def bounces(outcome: Outcome) -> int:
    """How often the ground's force ends."""
    touches = np.array(outcome.get("force")) > 0
    return int(np.sum(touches[:-1] & ~touches[1:]))


def unaccounted(outcome: Outcome) -> float:
    """|kinetic + strain + contact + dissipated - external| at the end, less that at the start, in percent of the
    dissipated."""
    kinds = outcome.get("energies")
    total = sum(np.array(kinds[kind]) for kind in ("kinetic", "strain", "contact", "dissipated"))
    total = total - np.array(kinds["external"])
    return float(100 * abs(total[-1] - total[0]) / kinds["dissipated"][-1])
