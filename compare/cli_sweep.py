"""The commands over many scenes: sweep, units, unit and index."""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.scene import Scene
    from compare.study import Unit


def add(commands: Any) -> None:
    """Add the commands to the parser's."""
    from compare import cli

    sweep = cli.add(commands, "sweep", _sweep, "solve many scenes at once; one table of all their rows", many=True)
    sweep.add_argument("--pages", action="store_true", help="write the page of each scene too")
    cli.budget(sweep)
    cli.working(sweep)

    units = cli.add(commands, "units", _units, "print the units of scenes as JSON, for a workflow engine", many=True)
    cli.budget(units)

    unit = cli.add(commands, "unit", _unit, "solve one unit of a scene, by its key")
    unit.add_argument("key", metavar="KEY", help="as printed by groovecheck units")
    cli.budget(unit)
    cli.working(unit)

    index = commands.add_parser("index", help="write the index of the pages in a folder")
    index.add_argument(
        "--out", type=Path, default=cli.OUT, metavar="DIR", help=f"folder of pages and results ({cli.OUT})"
    )
    index.set_defaults(command=_index)


def _sweep(options: argparse.Namespace) -> int:
    from compare import cli, formats, progress, study, table
    from compare.files import write_text

    asked = _asked(options.scene, options.budget)
    folder = cli.writable(options.out / "results")
    with progress.shown() as report:
        every = [unit for _, _, units in asked for unit in units]
        entries = study.solve(every, folder, options.jobs, report, not options.fresh, any_size=options.any_size)
    rows, names, done = [], [], 0
    for _, scenes, units in asked:
        own = entries[done : done + len(units)]
        done += len(units)
        rows += table.rows(own)
        names += [entry.scene.name for entry in table.in_ladders(own)]
        if options.pages:
            cli.print_page(scenes[0], own, table.rows(own), options.out)
    write_text(options.out / "sweep.csv", formats.as_csv(rows, names))
    page = importlib.import_module("reports.sweep").publish(names, rows, options.budget, options.out)
    cli.say_failures(entries)
    print(f"{len(asked)} scenes, {len(rows)} rows: {options.out / 'sweep.csv'}\npage: {page}")
    return cli.OK if all(entry.ok for entry in entries) else cli.REFUSED


def _asked(paths: list[str], budget: str) -> list[tuple[str, list[Scene], list[Unit]]]:
    """(path, scene with companions, units) of each; every wrong scene is told at once."""
    from compare import cli, study, sweep
    from compare.scene import SceneError

    found, problems = [], []
    for path in paths:
        try:
            scenes = cli.with_companions(path)
            units = [*study.plan(scenes, cli.SOLVERS, budget), *cli.third_solvers(scenes, budget)]
        except SceneError as error:
            problems += error.problems
            continue
        found.append((path, scenes, units))
        if not units:
            problems.append(f"{path}: no level within the budget {budget}")
    problems += sweep.clashes(found)
    if problems:
        raise SceneError(problems)
    return found


def _units(options: argparse.Namespace) -> int:
    from compare import cli, pool, sweep

    asked = _asked(options.scene, options.budget)
    units = {unit.key: unit for _, _, own in asked for unit in own}
    print(json.dumps(sweep.plan(asked, pool.estimate(list(units.values()), 2)), indent=1))
    return cli.OK


def _unit(options: argparse.Namespace) -> int:
    from compare import cli, study

    units = {unit.key: unit for _, _, own in _asked([options.scene], options.budget) for unit in own}
    if options.key not in units:
        raise cli.UsageError(
            f"{options.key}: no unit of {options.scene} within the budget {options.budget}; plan again"
        )
    folder = cli.writable(options.out / "results")
    (entry,) = study.solve([units[options.key]], folder, reuse=not options.fresh, any_size=options.any_size)
    print(f"{study.label(entry)}: {entry.status}")
    cli.say_failures([entry])
    return cli.OK if (folder / f"{options.key}.npz").exists() else cli.REFUSED


def _index(options: argparse.Namespace) -> int:
    from compare import cli, index

    if not options.out.is_dir():
        raise cli.UsageError(f"--out {options.out}: no such folder")
    print(f"page: {index.write(options.out)}")
    return cli.OK
