"""The commands that read another code's files and write ours for other programs: compare and export."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.scene import Level, Scene


def add(commands: Any) -> None:
    """Add the commands to the parser's."""
    from compare import cli

    compare = cli.add(commands, "compare", _compare, "put the exported answers of another code beside both solvers")
    compare.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="CSV (h,value[,seconds]) or a mesh with a displacement field",
    )
    compare.add_argument("--name", required=True, metavar="SOLVER", help="what the other code is called")
    compare.add_argument(
        "--h", type=float, action="append", metavar="METRES", help="element length of a field (its mean edge)"
    )
    compare.add_argument("--field", metavar="NAME", help="name of the displacement in a mesh file")
    cli.budget(compare)
    cli.working(compare)

    export = cli.add(
        commands, "export", _export, "write the surface of a level with displacement and stress, for ParaView"
    )
    export.add_argument("file", type=Path, metavar="FILE", help="name that ends with .vtu, .vtk or .xdmf")
    export.add_argument("--solver", choices=cli.SOLVERS, default="ancf", help="whose level (ancf)")
    export.add_argument(
        "--level",
        metavar="NAME",
        help='4x4 or h=0.1, or "4x4 conforming" where several levels are 4x4 (default: the finest of the budget in the '
        "first ladder, which pages draw boldest)",
    )
    cli.budget(export)
    cli.changing(export)
    cli.working(export)


def _compare(options: argparse.Namespace) -> int:
    from compare import cli
    from compare.external import exported
    from compare.table import rows

    sizes = options.h or [None] * len(options.files)
    if len(sizes) != len(options.files):
        raise cli.UsageError(f"--h was given {len(sizes)} times for {len(options.files)} files")
    scenes = cli.with_companions(options.scene)
    read = [
        entry
        for path, h in zip(options.files, sizes, strict=True)
        for entry in exported.entries(scenes[0], path, options.name, h, options.field)
    ]
    lengths = [entry.result.h for entry in read]
    if len(set(lengths)) < len(lengths):
        raise cli.UsageError(f"two levels of equal h: {sorted(lengths)}; give other lengths (--h)")
    entries, _ = cli.solved(scenes, options, options.budget)
    entries += sorted(read, key=lambda entry: -entry.result.h)
    table = rows(entries)
    cli.print_table(table)
    cli.say_failures(entries)
    cli.print_page(scenes[0], entries, table, options.out)
    return cli.OK if all(entry.ok for entry in entries) else cli.REFUSED


def _export(options: argparse.Namespace) -> int:
    from compare import cli, export, levels, study

    scene = cli.asked(options)[0]
    level = _level(scene, options)
    unit = study.unit(scene, None, options.solver, cli.SOLVERS[options.solver], level)
    folder = cli.writable(options.out / "results")
    (entry,) = study.solve([unit], folder, reuse=not options.fresh, any_size=options.any_size)
    if not entry.ok:
        cli.say_failures([entry])
        return cli.REFUSED
    export.write(entry.result, options.file)
    print(f"{scene.name}: {options.solver} {levels.full_name(level)}: {options.file}")
    return cli.OK


def _level(scene: Scene, options: argparse.Namespace) -> Level:
    """The level that is asked for, or the finest of the first ladder. Raises UsageError unless it is one."""
    from compare import cli, levels

    paid = scene.ladder(options.solver, options.budget)
    found = levels.find(options.level, paid) if options.level else paid
    if not found:
        named = ", ".join(dict.fromkeys(levels.names(scene.ladder(options.solver)))) or "none"
        raise cli.UsageError(
            f"no such level of {options.solver} within the budget {options.budget}; the scene has {named}"
        )
    if options.level and len(found) > 1:
        raise cli.UsageError(f"--level {options.level}: one of {len(found)} levels: {'; '.join(levels.names(found))}")
    return levels.finest(found)
