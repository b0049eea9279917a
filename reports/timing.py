"""How long a call takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any


def least(call: Callable[[], Any], repeats: int = 5) -> float:
    """Least CPU seconds of `repeats` calls: what one costs undisturbed, behind what the first has compiled or kept."""
    found = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        found.append(time.process_time() - begin)
    return min(found)
