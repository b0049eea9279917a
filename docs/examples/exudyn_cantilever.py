"""Run Exudyn's thin ANCF plate on the plain cantilever and write a table that `groovecheck compare` reads.

    pip install exudyn
    python docs/examples/exudyn_cantilever.py exudyn.csv 2 4 8
    groovecheck compare cantilever_plain exudyn.csv --name Exudyn --budget quick

All numbers of the plate are those of the scene; the arguments are the table and the numbers of elements along a side.
"""

import csv
import sys
from pathlib import Path

from compare.external import exudyn
from compare.scene import load


def main(table: str, meshes: list[int]) -> None:
    """Write the table, a line per mesh. Exits with a message where Exudyn is not installed."""
    if not exudyn.available():
        sys.exit("Exudyn is not installed: pip install exudyn")
    scene = load("cantilever_plain")
    plate, law, corner = scene.surface, scene.material, scene.loads[0]
    steps = round(scene.analysis.until / scene.ancf.levels[0].time_step)
    elastic = law.youngs_modulus, law.poissons_ratio, law.density
    with Path(table).open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(["h", "value", "seconds"])
        for mesh in meshes:
            found = exudyn.cantilever(mesh, steps, plate.length, scene.thickness, *elastic, corner.force[2])
            lines.writerow([plate.length / mesh, found.deflection, found.cpu_seconds])


if __name__ == "__main__":
    main(sys.argv[1], [int(word) for word in sys.argv[2:]])
