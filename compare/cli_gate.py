"""The commands of the gate: check a quick run against the accepted values, and accept its values."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.scene import Scene


def add(commands: Any) -> None:
    """Add the commands to the parser's."""
    from compare import cli

    check = cli.add(commands, "check", _check, "compare a quick run with the accepted values; exit 1 names what moved")
    check.add_argument("--junit", type=Path, metavar="FILE", help="write the verdict as JUnit XML")
    check.add_argument(
        "--summary", type=Path, metavar="FILE", help="append the verdict as Markdown ($GITHUB_STEP_SUMMARY)"
    )
    cli.working(check)

    accept = cli.add(commands, "accept", _accept, "make the values of a quick run the accepted ones")
    accept.add_argument("--reason", metavar="TEXT", help="why they changed, kept with them (asked for on a terminal)")
    cli.working(accept)


def _check(options: argparse.Namespace) -> int:
    from compare import ci, cli, gate

    scenes = cli.with_companions(options.scene)
    baseline = gate.read(_baseline(scenes[0]))
    entries, rows = cli.solved(scenes, options, "quick")
    verdict = gate.check(rows, baseline)
    ci.write(verdict, scenes[0].name, options.junit, options.summary)
    print("\n".join(gate.lines(verdict)))
    cli.say_failures(entries)
    if verdict.passed:
        print(f"{scenes[0].name}: {len(verdict.margins)} rows pass the gate")
        return cli.OK
    refused = [margin.row for margin in verdict.margins if margin.refused]
    print(f"{scenes[0].name}: the gate refuses {len(refused)} rows: " + "; ".join(refused), file=sys.stderr)
    return cli.REFUSED


def _accept(options: argparse.Namespace) -> int:
    from compare import cli, gate

    scenes = cli.with_companions(options.scene)
    reason = options.reason
    if reason is None:
        if not sys.stdin.isatty():
            raise cli.UsageError("accept needs --reason TEXT where nobody can be asked")
        reason = input("reason for the new values: ")
    if not reason.strip():
        raise cli.UsageError("accept needs a reason that says something")
    path = _baseline(scenes[0])
    _, rows = cli.solved(scenes, options, "quick")
    if path.exists():
        print("\n".join(gate.lines(gate.check(rows, gate.read(path)))))
    gate.accept(rows, reason, scenes[0].name, path)
    print(f"accepted {len(rows)} rows: {path}")
    return cli.OK


def _baseline(scene: Scene) -> Path:
    """Path of the accepted rows of a scene."""
    folder = importlib.util.find_spec("reports").submodule_search_locations[0]
    return Path(folder) / "baselines" / f"{scene.name}.json"
