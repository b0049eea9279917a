"""Run a scene through Snakemake and plainly, each from nothing, and compare every result number for number.

    python workflow/same.py cantilever full

prints each difference and exits with 1 where there is one. Only what tells times and memory may differ.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
MEASURED = ("seconds", "cpu_seconds", "peak_mb")  # in a result's header
COUNTED = ("repeats", "beside")  # of its facts, and all whose name ends with CLOCK
CLOCK = "_seconds"
TIMES = ("wall_seconds", "peak_mb")  # in a row of the page


def main(scene: str, budget: str) -> int:
    """Run both ways, print the differences; exit status 1 where there are any."""
    with tempfile.TemporaryDirectory() as folder:
        flow, plain = run(scene, budget, Path(folder))
        found, count = differences(flow, plain, scene)
    print("\n".join([*found, f"{count} results of {scene} at {budget}, {len(found)} differences"]))
    return int(bool(found) or not count)


def run(scene: str, budget: str, folder: Path, executor: Sequence[str] = ("--cores", "2")) -> tuple[Path, Path]:
    """The output folders of the workflow and of the plain run; executor: words that tell Snakemake where jobs run."""
    flow, plain = folder / "flow", folder / "plain"
    command = [sys.executable, "-m", "compare.cli"]
    engine = [sys.executable, "-m", "snakemake"] if importlib.util.find_spec("snakemake") else ["snakemake"]
    words = ["-s", str(ROOT / "workflow" / "Snakefile"), *executor, "--directory", str(folder), "--config"]
    config = [f"out={flow}", f"scenes={scene}", f"budget={budget}", f"command={' '.join(command)}"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([*engine, *words, *config], check=True, env=environment, stdout=sys.stderr)
    asked = ["run", scene, "--budget", budget, "--out", str(plain)]
    subprocess.run([*command, *asked], check=True, env=environment, stdout=sys.stderr)
    return flow, plain


def differences(flow: Path, plain: Path, scene: str) -> tuple[list[str], int]:
    """Words on each difference between two output folders, and the number of results compared."""
    names = [{path.name for path in (out / "results").glob("*.npz")} for out in (flow, plain)]
    found = [f"{name}: only one of both has it" for name in sorted(names[0] ^ names[1])]
    for name in sorted(names[0] & names[1]):
        one, other = (contents(out / "results" / name) for out in (flow, plain))
        found += [f"{name}: {key}" for key in sorted(one | other) if one.get(key) != other.get(key)]
    rows = [json.loads((out / f"{scene}.json").read_text())["rows"] for out in (flow, plain)]
    told = [[{key: value for key, value in row.items() if key not in TIMES} for row in page] for page in rows]
    return found + ([] if told[0] == told[1] else ["the rows of the pages"]), len(names[0] & names[1])


def contents(path: Path) -> dict[str, object]:
    """Every array of a result as (type, shape, bytes), and its header without what was measured."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: (str(a.dtype), a.shape, a.tobytes()) for name, a in file.items() if name != "header"}
        header = json.loads(str(file["header"]))
    header.get("level", {}).pop("budget", None)  # of a unit that two scenes share: as whichever asked first has it
    facts = {k: value for k, value in header["facts"].items() if k not in COUNTED and not k.endswith(CLOCK)}
    return arrays | {key: value for key, value in header.items() if key not in MEASURED} | {"facts": facts}


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
