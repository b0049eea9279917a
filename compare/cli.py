"""The groovecheck command. It knows solvers and studies by name only and imports them when they are needed."""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import importlib.util
import inspect
import signal
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare import cli_files, cli_gate, cli_sweep

if TYPE_CHECKING:
    from compare.scene import Scene
    from compare.study import Entry, Unit

SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
OUT = Path("reports/build")
PUBLISH = ["scene", "entries", "rows", "folder"]  # what an exhibit of a scene makes its page of
OK, REFUSED, WRONG, UNWRITTEN, INTERRUPTED = 0, 1, 2, 3, 130
ALONE = {"companions": [], "study": "scene", "published": None}  # a shipped scene whose physics was changed

DESCRIPTION = """\
How far a fast plate model can be trusted: plates with grooves by the absolute nodal
coordinate formulation (ancf) and by quadratic tetrahedra on the same solid (reference),
compared with each other and with published values.

SCENE is the name of a shipped scene (groovecheck scenes) or the path of a TOML file.
All quantities are SI: metres, seconds, newtons, pascals, kg/m3."""

EXAMPLES = """\
examples:
  groovecheck scenes                             what is shipped
  groovecheck explain cantilever                 what would be computed, unknowns, memory
  groovecheck run cantilever --budget quick      solve, print the table, write the page
  groovecheck run my_plate.toml --solver ancf    a scene of your own, one solver
  groovecheck run cantilever --set thickness=0.06 --set grooves.0.depth=0.02
  groovecheck table cantilever --format json > rows.json
  groovecheck sweep my_scenes/*.toml             many scenes, one table
  groovecheck compare my_plate.toml abaqus.csv --name Abaqus    another code's answers beside both
  groovecheck check cantilever                   compare with the accepted values
  groovecheck accept cantilever --reason "exact rule for row 5"

exit codes:
  0    done
  1    the gate refused, or a unit of the study failed (its row carries the reason)
  2    wrong scene, file or usage; nothing was computed
  3    a file could not be read or written (full disk, folder without permission); finished results are kept
  130  interrupted; finished results are kept and reused"""


class UsageError(ValueError):
    """A command that cannot be carried out as given."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code. Errors of the user are one message on standard error."""
    options = parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a termination ends the workers as an interrupt does
    try:
        return options.command(options)
    except KeyboardInterrupt:
        print("interrupted; finished results are kept and will be reused", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()
        return REFUSED
    except OSError as error:
        where = error.filename2 or error.filename
        print(f"groovecheck: {f'{where}: ' if where else ''}{error.strerror or error}", file=sys.stderr)
        return UNWRITTEN
    except ValueError as error:
        if not isinstance(error, _user_errors()):
            raise
        print(f"groovecheck: {error}", file=sys.stderr)
        return WRONG


def _user_errors() -> tuple[type[Exception], ...]:
    from compare.export import ExportError as NotExported
    from compare.external.exported import ExportError
    from compare.gate import BaselineError
    from compare.scene import SceneError

    return UsageError, SceneError, BaselineError, ExportError, NotExported


def parser() -> argparse.ArgumentParser:
    """The parser of every command."""
    made = argparse.ArgumentParser(
        prog="groovecheck",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("--version", action="version", version=f"%(prog)s {importlib.metadata.version('groovecheck')}")
    commands = made.add_subparsers(title="commands", metavar="COMMAND", required=True)

    run = add(commands, "run", _run, "solve a scene, print its table, write its page and JSON")
    budget(run)
    run.add_argument("--solver", choices=SOLVERS, help="only this solver (default: every one the scene has levels for)")
    changing(run)
    working(run)
    run.add_argument(
        "--timed",
        action="store_true",
        help="run the levels of the ladders alone, one after the other, for wall times to compare; what nobody's "
        "time is read of still runs beside others",
    )

    table = add(commands, "table", _table, "print the rows of a scene and its companions to standard output")
    table.add_argument("--format", choices=("md", "tex", "csv", "json"), default="md", help="default: md")
    budget(table)
    changing(table)
    working(table)

    cli_files.add(commands)
    cli_gate.add(commands)

    explain = add(commands, "explain", _explain, "say what will be modelled, what is left out, unknowns and memory")
    budget(explain)
    changing(explain)

    cli_sweep.add(commands)
    scenes = commands.add_parser("scenes", help="list the shipped scenes")
    scenes.set_defaults(command=_scenes)
    return made


def add(commands: Any, name: str, command: Any, about: str, many: bool = False) -> argparse.ArgumentParser:
    parser = commands.add_parser(name, help=about, description=f"{about[0].upper()}{about[1:]}.")
    words = "name of a shipped scene or path of a .toml file"
    parser.add_argument("scene", metavar="SCENE", nargs="+" if many else None, help=words)
    parser.set_defaults(command=command)
    return parser


def budget(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--budget",
        choices=("quick", "standard", "full"),
        default="standard",
        help="which levels of the ladders to pay for (default: standard)",
    )


def changing(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="set a dotted key of SCENE, for example material.youngs_modulus=2.1e6 or grooves.0.depth=0.02; "
        "a scene whose physics is changed so runs without its companions and its published values",
    )


def working(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--jobs", type=_count, default=2, metavar="N", help="processes at a time, one thread each (2)")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR", help=f"folder of pages and results ({OUT})")
    parser.add_argument("--fresh", action="store_true", help="solve everything again, reuse no earlier result")
    parser.add_argument(
        "--any-size", action="store_true", help="solve levels too that need far more memory than this machine has"
    )


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not a positive number")
    return value


def _run(options: argparse.Namespace) -> int:
    scenes = asked(options)
    others = () if options.solver else third_solvers(scenes, options.budget)
    entries, rows = solved(scenes, options, options.budget, options.solver, others)
    print_table(rows)
    say_failures(entries)
    print_page(scenes[0], entries, rows, options.out)
    return OK if all(entry.ok for entry in entries) else REFUSED


def print_page(scene: Scene, entries: list[Entry], rows: list[dict[str, Any]], folder: Path) -> None:
    """Publish the page of the scene's exhibit and say where it is."""
    print(f"page: {exhibit(scene).publish(scene, entries, rows, folder)}")


def _table(options: argparse.Namespace) -> int:
    entries, rows = solved(asked(options), options, options.budget)
    from compare.formats import FORMATS

    sys.stdout.write(FORMATS[options.format](rows))
    say_failures(entries)
    return OK if all(entry.ok for entry in entries) else REFUSED


def _explain(options: argparse.Namespace) -> int:
    from compare.explain import explain
    from compare.scene_geometry import too_thick

    scene = asked(options)[0]
    print("\n".join(explain(scene, options.budget, SOLVERS)))
    if words := too_thick(scene):
        print(f"\nwarning: {words}")
    return OK


def _scenes(options: argparse.Namespace) -> int:
    from compare.scene import SceneError, load, names

    width = max(map(len, names()), default=0)
    for name in names():
        try:
            print(f"{name:{width}}  {load(name).title}")
        except SceneError as error:
            print(f"{name:{width}}  wrong scene: {error.problems[0]}")
    return OK


def asked(options: argparse.Namespace) -> list[Scene]:
    """The scene and its companions, as --set changes them."""
    return _changed(with_companions(options.scene), options.set)


def with_companions(name: str) -> list[Scene]:
    """The scene and its companions, which are shipped names or paths relative to the scene's file.

    Raises SceneError where two of them have one name, by which tables and pages know them.
    """
    from compare.scene import SceneError, load

    scene = _of_its_own(load(name), Path(name))
    files, scenes = {scene.name: name}, [scene]
    for other in scene.companions:
        path = str(Path(name).parent / other) if other.endswith(".toml") else other
        companion = load(path)
        if companion.name in files:
            taken = f"that of {files[companion.name]}, which runs with it; state another"
            raise SceneError([f"{path}: name = {companion.name!r}: {taken}"])
        files[companion.name] = path
        scenes.append(companion)
    return scenes


def _of_its_own(scene: Scene, path: Path) -> Scene:
    """The scene of a file; an edited copy of a shipped scene that kept its name takes the file's.

    Otherwise another plate would be published, and accepted, as the shipped one and beside its printed values.
    """
    from compare.scene import load, names

    if scene.name not in names() or scene.physics() == load(scene.name).physics():
        return scene
    name = path.stem if path.stem not in names() else f"{path.stem}_own"
    print(
        f"{path}: states another plate than the shipped {scene.name}; it is called {name} here and runs without "
        f"the companions, published values and page of {scene.name}",
        file=sys.stderr,
    )
    return scene.override(ALONE, name)


def _changed(scenes: list[Scene], settings: list[str]) -> list[Scene]:
    """The scenes after --set: a scene whose physics changed is alone and has no published values."""
    if not settings:
        return scenes
    stated, changes = scenes[0], dict(_setting(text) for text in settings)
    changed = stated.override({**changes, **ALONE, "sensitivity": None}, f"{stated.name}_set")
    if changed.physics() != {**stated.physics(), "name": changed.name}:
        return [changed]
    return [stated.override(changes), *scenes[1:]]


def _setting(text: str) -> tuple[str, Any]:
    """("material.density", 1000.0) of "material.density=1000.0"; a value that is not TOML is a string."""
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise UsageError(f"--set {text}: write KEY=VALUE")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def exhibit(scene: Scene) -> Any:
    """The module that publishes a scene. Raises SceneError where there is none, or one of pages of another kind."""
    from compare.scene import SceneError

    name = f"reports.{scene.study}"
    module = importlib.import_module(name) if importlib.util.find_spec(name) else None
    publish = getattr(module, "publish", None)
    if publish is None or [*inspect.signature(publish).parameters] != PUBLISH:
        raise SceneError([f"{scene.name}: study = {scene.study!r}: {name} makes no page of a scene; leave this out"])
    return module


def third_solvers(scenes: list[Scene], budget: str) -> Sequence[Unit]:
    """Units of codes that nobody here wrote, where the scene's exhibit wants them and they are installed."""
    return getattr(exhibit(scenes[0]), "third_solvers", lambda *_: ())(scenes, budget)


def solved(
    scenes: list[Scene],
    options: argparse.Namespace,
    budget: str,
    solver: str | None = None,
    others: Sequence[Unit] = (),
) -> tuple[list[Entry], list[dict[str, Any]]]:
    """Entries and rows of the scenes by one solver or all, and of other units; progress on standard error."""
    solvers = {solver: SOLVERS[solver]} if solver else SOLVERS
    for scene in scenes:
        if not any(scene.ladder(solver, budget) for solver in solvers):
            raise UsageError(f"{scene.name}: no level of {' or '.join(solvers)} within the budget {budget}")
    if scenes[0].study != ALONE["study"]:
        exhibit(scenes[0])  # a wrong one is told before anything is solved
    from compare import progress, study, table
    from compare.scene_geometry import too_thick

    for scene in scenes:
        if words := too_thick(scene):
            print(f"warning: {scene.name}: {words}", file=sys.stderr)
    folder = writable(options.out / "results")
    with progress.shown() as report:
        units = [*study.plan(scenes, solvers, budget), *others]
        timed = getattr(options, "timed", False)
        entries = study.solve(units, folder, options.jobs, report, not options.fresh, timed, options.any_size)
    fresh = len({entry.key for entry in entries if entry.fresh and entry.result})
    reused = len({entry.key for entry in entries if not entry.fresh})
    print(f"{fresh} units solved, {reused} reused", file=sys.stderr)
    return entries, table.rows(entries)


def writable(folder: Path) -> Path:
    """The folder, made where it is missing. Raises UsageError where nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise UsageError(f"--out {folder.parent}: cannot be written: {error.strerror}") from error


def print_table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console

    from compare.formats import as_terminal

    console = Console(width=max(Console().width, 130))
    for drawn in as_terminal(rows):
        console.print(drawn)


def say_failures(entries: list[Entry]) -> None:
    from compare.study import label

    for entry in entries:
        if not entry.ok:
            print(f"failed: {label(entry)}: {entry.status}\n{entry.message}".rstrip(), file=sys.stderr)


if __name__ == "__main__":
    # Run the module that the other commands import, not a second copy of it.
    from compare.cli import main as run

    sys.exit(run())
