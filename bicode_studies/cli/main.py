"""The command line ``bicode COMMAND``. Each command is a file of this folder.

A command is imported only when it is called, so that ``bicode --help`` answers at once.
Misuse ends with one line on stderr and exit code 2; ``--debug`` shows the traceback.

Click's own ``main`` is not called: it would turn a closed pipe into exit code 1 and a damaged file (``EOFError``) into
a stop from the keyboard.
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
    "inspect": ("helpers.inspect", "inspect", "Say whether a recording is sound, and what to change on the camera."),
    "marker": ("marker", "marker", "Write what it takes to build a marker: sheets, parts, transmitter."),
    "run": ("run", "run", "Run one notebook with other parameters."),
    "figures": ("run", "figures", "Run all notebooks and write all figures."),
    "html": ("html", "html", "Run all notebooks and write them as HTML pages."),
    "sweep": ("sweep", "sweep_command", "Run the trials of a figure and write their accuracies."),
    "claims": ("claims", "claims", "Compare every claim of the paper with our trials."),
    "calibrate": ("calibrate", "calibrate_command", "Find the constants that agree with Fig. 8 and with measurements."),
    "stress": ("stress", "stress", "Measure the accuracy of all receivers on degraded recordings."),
    "false-ids": ("false_ids", "false_ids", "Count the IDs that are read although no marker is in view."),
    "compare-receivers": (
        "comparisons.compare_receivers",
        "compare_receivers",
        "Let three receivers read the same recordings and compare them.",
    ),
    "name-lights": (
        "comparisons.name_lights",
        "name_lights",
        "Name lights of known kinds, and count how often the name is right.",
    ),
    "what-if": ("what_if", "what_if", "Open a page with sliders for rates, distances and times."),
    "bench": ("bench", "bench", "Measure the speed of simulation and receivers on this machine."),
    "doctor": ("doctor", "doctor", "Check that all that is needed is installed and works."),
}


WITHOUT_KERNELS = {"marker", "claims", "doctor"}


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

    The code is 0 on success, also if the reader of a pipe has seen enough; 1 if something that ran failed (a notebook,
    a check) or an error was not foreseen; 2 for misuse or a bad file (with one line on stderr); 130 if the command was
    stopped from the keyboard.

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
        code = _call(typed)
        sys.stdout.flush()
        return code
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
        _write_to_nobody()
        return 0
    except Exception as error:
        return _explain(error)


def _call(typed: list[str]) -> int:
    """Call the command of the words that were typed and return its exit code."""
    if "_BICODE_COMPLETE" in os.environ:  # the shell asks for completions
        cli.main(args=typed, prog_name="bicode")
    _refuse_kernels_without_compiler(typed)
    with cli.make_context("bicode", typed) as ctx:
        result = cli.invoke(ctx)
    return result if isinstance(result, int) else 0


def _refuse_kernels_without_compiler(typed: list[str]) -> None:
    """Raise ValueError if numba is told not to compile and the command needs kernels, which run only compiled."""
    told = os.environ.get("NUMBA_DISABLE_JIT", "")
    needs = any(word in COMMANDS and word not in WITHOUT_KERNELS for word in typed[:2])
    if told not in ("", "0") and needs and not {"-h", "--help"} & set(typed):
        raise ValueError(f"NUMBA_DISABLE_JIT={told} is set, and this command's kernels run only compiled; unset it")


def _explain(error: Exception) -> int:
    """Write one line on an error that is no misuse of options, and return the exit code."""
    damage = _damaged_kernel(error)
    if damage:
        return _report(damage, 2)
    if isinstance(error, OSError):
        named = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
        return _report(named, 2)
    if isinstance(error, ValueError | metadata.PackageNotFoundError):
        return _report(str(error), 2)
    if isinstance(error, MemoryError):
        return _report(f"there is not enough memory ({error or 'MemoryError'}); read a shorter file, or free some", 2)
    return _report(
        f"{type(error).__name__}: {error} (this was not foreseen; bicode --debug ... shows where it happened)", 1
    )


def _damaged_kernel(error: Exception) -> str | None:
    """Return a line on a damaged compiled kernel if that is the cause; numba is not imported for that."""
    if "numba" not in sys.modules:
        return None
    from bicode_studies.cli.helpers.kernel_files import explain_damage

    return explain_damage(error)


def _write_to_nobody() -> None:
    """Let everything that is still to be written to a closed pipe go nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(nowhere, stream.fileno())
        except (OSError, ValueError):
            pass


def _where_to_read(error: click.ClickException) -> str:
    """Say which help explains the command that was misused; nothing if it was ``bicode`` itself."""
    ctx = getattr(error, "ctx", None)
    return f" (see: bicode {ctx.info_name} --help)" if ctx is not None and ctx.parent is not None else ""


def _report(message: str, code: int) -> int:
    """Write one line to stderr, below the traceback if that was asked for, and return the exit code."""
    if os.environ.get("BICODE_DEBUG", "0") not in ("", "0"):
        traceback.print_exc()
    try:
        click.echo(f"bicode: {' '.join(message.split())}", err=True)
    except BrokenPipeError:
        _write_to_nobody()
    return code
