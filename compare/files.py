"""Files written in one step: a process that is killed, or a disk that is full, leaves the old file or none."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

STALE = 86400.0  # s: an unfinished file of this age belongs to no process that still writes it
PART = ".part"


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A binary file that takes the place of `path` when the block ends, and vanishes where it raises.

    Two processes may write one path at once: the later one stays. Raises OSError naming the path.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=PART, delete=False) as file:
        try:
            yield file
            file.flush()
            os.fchmod(file.fileno(), 0o666 & ~_umask())
            os.replace(file.name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(file.name)
            raise


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text in one step."""
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def sweep(folder: Path) -> int:
    """Remove what killed processes left unfinished in a folder a day ago or earlier; returns how many."""
    count, now = 0, time.time()
    for path in folder.glob(f"*{PART}"):
        with suppress(OSError):
            if now - path.stat().st_mtime > STALE:
                path.unlink()
                count += 1
    return count


def _umask() -> int:
    """The process's umask, which can only be read by setting it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
