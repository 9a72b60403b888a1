"""The command line: ``bicode COMMAND``. Each command is a file ``cli/`` beside this one.

A command is imported when it is asked for, so that ``bicode --help`` answers at once.
Misuse ends with one line on stderr and exit code 2; ``--debug`` shows where it came from.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata

import click

COMMANDS = {
    # name: (module of bicode_studies.cli, function in it, what it does)
    "simulate": ("simulate", "simulate", "Make the events of a blinking marker, and the truth beside them."),
    "decode": ("decode", "decode", "Read IDs and poses from a recording."),
    "marker": ("marker", "marker", "Build a marker: sheets to cut, list of parts, transmitter."),
    "false-ids": ("false_ids", "false_ids", "Count the IDs that are read where no marker is."),
    "stress": ("stress", "stress", "Accuracy of both receivers as recordings get worse."),
    "calibrate": ("calibrate", "calibrate_command", "Fit the free constants to Fig. 8."),
    "sweep": ("sweep", "sweep_command", "Run the trials of a figure and print their accuracies."),
    "claims": ("claims", "claims", "Compare every claim of the paper with the figures' trials."),
    "what-if": ("what_if", "what_if", "Ask what if with sliders, on a page in the browser."),
    "run": ("run", "run", "Run one notebook with other parameters."),
    "figures": ("run", "figures", "Run every notebook and write every figure."),
    "bench": ("bench", "bench", "Measure how fast this is on this machine."),
    "mystery": ("mystery", "mystery", "Make a recording whose IDs are to be found."),
    "html": ("html", "html", "Run every notebook and write it as pages that need no notebook to be read."),
    "doctor": ("doctor", "doctor", "Check that everything needed is here and works."),
}


class LazyGroup(click.Group):
    """A group of commands that are imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of the commands whose file is there."""
        return [name for name, (module, _, _) in COMMANDS.items() if importlib.util.find_spec(_full(module))]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A name in, its command out (imported now), or None."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module, function, _ = COMMANDS[cmd_name]
        command: click.Command = getattr(importlib.import_module(_full(module)), function)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that was typed; a misspelt one is an error that names the nearest."""
        names = self.list_commands(ctx)
        if args and not args[0].startswith("-") and args[0] not in names:
            near = difflib.get_close_matches(args[0], names, n=1)
            guess = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names)}"
            ctx.fail(f"no command {args[0]!r}; {guess}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands in the help, written without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][2]) for name in self.list_commands(ctx)])


def _full(module: str) -> str:
    return f"bicode_studies.cli.{module}"


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--debug", is_flag=True, help="Show the traceback of an error (as does BICODE_DEBUG=1).")
@click.version_option(package_name="bicode-lab", message="bicode_lab %(version)s")
def cli(debug: bool) -> None:
    """Simulate, read and study Bicode markers seen by an event camera."""
    if debug:
        os.environ["BICODE_DEBUG"] = "1"


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line arguments in; the process ends with the exit code.

    0: done. 1: something that ran failed (a notebook, a check). 2: misuse or a bad file,
    in one line. 130: stopped from the keyboard.
    """
    sys.exit(_run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command; errors become one line and the exit code."""
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
        return _say(error.format_message() + _where_to_read(error), error.exit_code)
    except BrokenPipeError:  # the reader of a pipe (head, less) has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
        return _say(named, 2)
    except (ValueError, metadata.PackageNotFoundError) as error:
        return _say(str(error), 2)


def _where_to_read(error: click.ClickException) -> str:
    """Where misuse of one command (not of bicode itself) is explained."""
    ctx = getattr(error, "ctx", None)
    return f" (see: bicode {ctx.info_name} --help)" if ctx is not None and ctx.parent is not None else ""


def _say(message: str, code: int) -> int:
    """One line on stderr, below the traceback where that was asked for."""
    if os.environ.get("BICODE_DEBUG", "0") not in ("", "0"):
        traceback.print_exc()
    click.echo(f"bicode: {' '.join(message.split())}", err=True)
    return code
