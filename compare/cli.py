"""The groovecheck command. It knows solvers and studies by name only and imports them when they are needed."""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import signal
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.scene import Scene
    from compare.study import Entry, Unit

SOLVERS = {"ancf": "ancf.run", "reference": "reference_fe.run"}
OUT = Path("reports/build")
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
    options = _parser().parse_args(arguments)
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


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="groovecheck",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    run = _add(commands, "run", _run, "solve a scene, print its table, write its page and JSON")
    _budget(run)
    run.add_argument("--solver", choices=SOLVERS, help="only this solver (default: every one the scene has levels for)")
    run.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="set a dotted key of SCENE, for example material.youngs_modulus=2.1e6 or grooves.0.depth=0.02; "
        "a scene whose physics is changed so runs without its companions and its published values",
    )
    _working(run)

    compare = _add(commands, "compare", _compare, "put the exported answers of another code beside both solvers")
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
    _budget(compare)
    _working(compare)

    table = _add(commands, "table", _table, "print the rows of a scene and its companions to standard output")
    table.add_argument("--format", choices=("md", "tex", "csv", "json"), default="md", help="default: md")
    _budget(table)
    _working(table)

    export = _add(commands, "export", _export, "write the surface of a level with its displacement, for ParaView")
    export.add_argument("file", type=Path, metavar="FILE", help="name that ends with .vtu, .vtk or .xdmf")
    export.add_argument("--solver", choices=SOLVERS, default="ancf", help="whose level (ancf)")
    export.add_argument("--level", metavar="NAME", help="4x4 or h=0.1 (default: the finest of the budget)")
    _budget(export)
    _working(export)

    check = _add(commands, "check", _check, "compare a quick run with the accepted values; exit 1 names what moved")
    check.add_argument("--junit", type=Path, metavar="FILE", help="write the verdict as JUnit XML")
    check.add_argument(
        "--summary", type=Path, metavar="FILE", help="append the verdict as Markdown ($GITHUB_STEP_SUMMARY)"
    )
    _working(check)

    accept = _add(commands, "accept", _accept, "make the values of a quick run the accepted ones")
    accept.add_argument("--reason", metavar="TEXT", help="why they changed, kept with them (asked for on a terminal)")
    _working(accept)

    explain = _add(commands, "explain", _explain, "say what will be modelled, what is left out, unknowns and memory")
    _budget(explain)

    scenes = commands.add_parser("scenes", help="list the shipped scenes")
    scenes.set_defaults(command=_scenes)
    return parser


def _add(commands: Any, name: str, command: Any, about: str) -> argparse.ArgumentParser:
    parser = commands.add_parser(name, help=about, description=f"{about[0].upper()}{about[1:]}.")
    parser.add_argument("scene", metavar="SCENE", help="name of a shipped scene or path of a .toml file")
    parser.set_defaults(command=command)
    return parser


def _budget(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--budget",
        choices=("quick", "standard", "full"),
        default="standard",
        help="which levels of the ladders to pay for (default: standard)",
    )


def _working(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--jobs", type=_count, default=2, metavar="N", help="processes at a time, one thread each (2)")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR", help=f"folder of pages and results ({OUT})")
    parser.add_argument("--fresh", action="store_true", help="solve everything again, reuse no earlier result")


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not a positive number")
    return value


def _run(options: argparse.Namespace) -> int:
    scenes = _changed(_with_companions(options.scene), options.set)
    others = () if options.solver else _third_solvers(scenes, options.budget)
    entries, rows = _solved(scenes, options, options.budget, options.solver, others)
    _print_table(rows)
    _say_failures(entries)
    _print_page(scenes[0], entries, rows, options.out)
    return OK if all(entry.ok for entry in entries) else REFUSED


def _print_page(scene: Scene, entries: list[Entry], rows: list[dict[str, Any]], folder: Path) -> None:
    """Publish the page of the scene's exhibit and say where it is; a scene may name an exhibit that is not there."""
    module = _exhibit(scene)
    if module is None:
        print(f"no page: reports.{scene.study} does not exist", file=sys.stderr)
    else:
        print(f"page: {module.publish(scene, entries, rows, folder)}")


def _table(options: argparse.Namespace) -> int:
    entries, rows = _solved(_with_companions(options.scene), options, options.budget)
    from compare.table import FORMATS

    sys.stdout.write(FORMATS[options.format](rows))
    _say_failures(entries)
    return OK if all(entry.ok for entry in entries) else REFUSED


def _check(options: argparse.Namespace) -> int:
    from compare import ci, gate

    scenes = _with_companions(options.scene, as_named=True)
    baseline = gate.read(_baseline(scenes[0]))
    entries, rows = _solved(scenes, options, "quick")
    verdict = gate.check(rows, baseline)
    ci.write(verdict, scenes[0].name, options.junit, options.summary)
    print("\n".join(gate.lines(verdict)))
    _say_failures(entries)
    if verdict.passed:
        print(f"{scenes[0].name}: {len(verdict.margins)} rows pass the gate")
        return OK
    refused = [margin.row for margin in verdict.margins if margin.refused]
    print(f"{scenes[0].name}: the gate refuses {len(refused)} rows: " + "; ".join(refused), file=sys.stderr)
    return REFUSED


def _export(options: argparse.Namespace) -> int:
    from compare import export, study

    scene = _with_companions(options.scene)[0]
    levels = scene.ladder(options.solver, options.budget)
    if options.level:
        levels = [level for level in levels if study.level_name(level) == options.level]
    if not levels:
        named = ", ".join(dict.fromkeys(map(study.level_name, scene.ladder(options.solver)))) or "none"
        raise UsageError(f"no such level of {options.solver} within the budget {options.budget}; the scene has {named}")
    unit = study.unit(scene, None, options.solver, SOLVERS[options.solver], levels[-1])
    folder = _writable(options.out / "results")
    (entry,) = study.solve([unit], folder, reuse=not options.fresh)
    if not entry.ok:
        _say_failures([entry])
        return REFUSED
    export.write(entry.result, options.file)
    print(f"{study.label(entry)}: {options.file}")
    return OK


def _accept(options: argparse.Namespace) -> int:
    from compare import gate

    scenes = _with_companions(options.scene)
    reason = options.reason
    if reason is None:
        if not sys.stdin.isatty():
            raise UsageError("accept needs --reason TEXT where nobody can be asked")
        reason = input("reason for the new values: ")
    if not reason.strip():
        raise UsageError("accept needs a reason that says something")
    path = _baseline(scenes[0])
    _, rows = _solved(scenes, options, "quick")
    if path.exists():
        print("\n".join(gate.lines(gate.check(rows, gate.read(path)))))
    gate.accept(rows, reason, scenes[0].name, path)
    print(f"accepted {len(rows)} rows: {path}")
    return OK


def _explain(options: argparse.Namespace) -> int:
    from compare.explain import explain

    print("\n".join(explain(_with_companions(options.scene)[0], options.budget, SOLVERS)))
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


def _with_companions(name: str, as_named: bool = False) -> list[Scene]:
    """The scene and its companions, which are shipped names or paths relative to the scene's file.

    as_named: a file stands for the scene that it names, whatever else it states.
    """
    from compare.scene import load

    scene = load(name) if as_named else _of_its_own(load(name), Path(name))
    folder = Path(name).parent
    return [scene, *(load(folder / other if other.endswith(".toml") else other) for other in scene.companions)]


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


def _compare(options: argparse.Namespace) -> int:
    from compare.external import exported
    from compare.table import rows

    sizes = options.h or [None] * len(options.files)
    if len(sizes) != len(options.files):
        raise UsageError(f"--h was given {len(sizes)} times for {len(options.files)} files")
    scenes = _with_companions(options.scene)
    read = [
        entry
        for path, h in zip(options.files, sizes, strict=True)
        for entry in exported.entries(scenes[0], path, options.name, h, options.field)
    ]
    lengths = [entry.result.h for entry in read]
    if len(set(lengths)) < len(lengths):
        raise UsageError(f"two levels of equal h: {sorted(lengths)}; give other lengths (--h)")
    entries, _ = _solved(scenes, options, options.budget)
    entries += sorted(read, key=lambda entry: -entry.result.h)
    table = rows(entries)
    _print_table(table)
    _say_failures(entries)
    _print_page(scenes[0], entries, table, options.out)
    return OK if all(entry.ok for entry in entries) else REFUSED


def _exhibit(scene: Scene) -> Any:
    """The module that publishes a scene, None where it names one that does not exist."""
    study = f"reports.{scene.study}"
    module = importlib.import_module(study) if importlib.util.find_spec(study) else None
    return module if hasattr(module, "publish") else None


def _third_solvers(scenes: list[Scene], budget: str) -> Sequence[Unit]:
    """Units of codes that nobody here wrote, where the scene's exhibit wants them and they are installed."""
    return getattr(_exhibit(scenes[0]), "third_solvers", lambda *_: ())(scenes, budget)


def _solved(
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
    from compare import progress, study, table

    folder = _writable(options.out / "results")
    with progress.shown() as report:
        units = [*study.plan(scenes, solvers, budget), *others]
        entries = study.solve(units, folder, options.jobs, report, reuse=not options.fresh)
    fresh = len({entry.key for entry in entries if entry.fresh})
    print(f"{fresh} units solved, {len({entry.key for entry in entries}) - fresh} reused", file=sys.stderr)
    return entries, table.rows(entries)


def _writable(folder: Path) -> Path:
    """The folder, made where it is missing. Raises UsageError where nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise UsageError(f"--out {folder.parent}: cannot be written: {error.strerror}") from error


def _print_table(rows: list[dict[str, Any]]) -> None:
    from rich.console import Console

    from compare.table import as_terminal

    console = Console(width=max(Console().width, 130))
    for drawn in as_terminal(rows):
        console.print(drawn)


def _say_failures(entries: list[Entry]) -> None:
    from compare.study import label

    for entry in entries:
        if not entry.ok:
            print(f"failed: {label(entry)}: {entry.status}\n{entry.message}".rstrip(), file=sys.stderr)


def _baseline(scene: Scene) -> Path:
    """Path of the accepted rows of a scene."""
    folder = importlib.util.find_spec("reports").submodule_search_locations[0]
    return Path(folder) / "baselines" / f"{scene.name}.json"


if __name__ == "__main__":
    sys.exit(main())
