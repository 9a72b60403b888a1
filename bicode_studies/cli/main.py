"""The command line ``bicode COMMAND``. Each command is a file of this folder.

A command is imported only when it is called, so that ``bicode --help`` answers at once.
Misuse ends with one line on stderr and exit code 2; ``--debug`` shows the traceback.
"""

from __future__ import annotations

import difflib
import importlib
import os
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata

import click

COMMANDS = {
    # name: (module of bicode_studies.cli, function in it, what it does)
    "simulate": ("simulate", "simulate", "Simulate a blinking marker: write its events and the ground truth."),
    "decode": ("decode", "decode", "Read IDs and poses from a recording of an event camera."),
    "marker": ("marker", "marker", "Write what it takes to build a marker: sheets, parts, transmitter."),
    "run": ("run", "run", "Run one notebook with other parameters."),
    "figures": ("run", "figures", "Run all notebooks and write all figures."),
    "html": ("html", "html", "Run all notebooks and write them as HTML pages."),
    "sweep": ("sweep", "sweep_command", "Run the trials of a figure and write their accuracies."),
    "claims": ("claims", "claims", "Compare every claim of the paper with our trials."),
    "calibrate": ("calibrate", "calibrate_command", "Find the constants that agree with Fig. 8 and with measurements."),
    "stress": ("stress", "stress", "Measure the accuracy of all receivers on degraded recordings."),
    "false-ids": ("false_ids", "false_ids", "Count the IDs that are read although no marker is in view."),
    "what-if": ("what_if", "what_if", "Open a page with sliders for rates, distances and times."),
    "bench": ("bench", "bench", "Measure the speed of simulation and receivers on this machine."),
    "doctor": ("doctor", "doctor", "Check that all that is needed is installed and works."),
}


class LazyGroup(click.Group):
    """A group of commands that are imported only when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command and return it; None if there is no command of that name."""
        if cmd_name not in COMMANDS:
            return None
        module, function, _ = COMMANDS[cmd_name]
        command: click.Command = getattr(importlib.import_module(f"bicode_studies.cli.{module}"), function)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that was typed; for an unknown one, fail and suggest the nearest name."""
        names = self.list_commands(ctx)
        if args and not args[0].startswith("-") and args[0] not in names:
            near = difflib.get_close_matches(args[0], names, n=1)
            guess = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names)}"
            ctx.fail(f"no command {args[0]!r}; {guess}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][2]) for name in self.list_commands(ctx)])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--debug", is_flag=True, help="Show the traceback of an error, as BICODE_DEBUG=1 does.")
@click.version_option(package_name="bicode-lab", message="bicode_lab %(version)s")
def cli(debug: bool) -> None:
    """Simulate, read and study Bicode markers that an event camera sees."""
    if debug:
        os.environ["BICODE_DEBUG"] = "1"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and end the process with its exit code.

    The code is 0 on success, 1 if something that ran failed (a notebook, a check), 2 for misuse or a bad file (with
    one line on stderr) and 130 if the command was stopped from the keyboard.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``bicode``; by default those of the process.
    """
    sys.exit(_run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command and return its exit code; an error becomes one line on stderr."""
    try:
        typed = list(sys.argv[1:] if arguments is None else arguments)
        result = cli.main(args=typed, prog_name="bicode", standalone_mode=False)
        return result if isinstance(result, int) else 0
    except click.exceptions.Exit as ended:
        return ended.exit_code
    except (KeyboardInterrupt, click.Abort):
        click.echo("bicode: stopped", err=True)
        return 130
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return error.exit_code
    except click.ClickException as error:
        return _report(error.format_message() + _where_to_read(error), error.exit_code)
    except BrokenPipeError:  # the program that reads our output (head, less) has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
        return _report(named, 2)
    except (ValueError, metadata.PackageNotFoundError) as error:
        return _report(str(error), 2)


def _where_to_read(error: click.ClickException) -> str:
    """Say which help explains the command that was misused; nothing if it was ``bicode`` itself."""
    ctx = getattr(error, "ctx", None)
    return f" (see: bicode {ctx.info_name} --help)" if ctx is not None and ctx.parent is not None else ""


def _report(message: str, code: int) -> int:
    """Write one line to stderr, below the traceback if that was asked for, and return the exit code."""
    if os.environ.get("BICODE_DEBUG", "0") not in ("", "0"):
        traceback.print_exc()
    click.echo(f"bicode: {' '.join(message.split())}", err=True)
    return code
