"""The command ``wentry``: finds a command's file when it is called for, and turns errors into exit codes."""

from __future__ import annotations

import contextlib
import importlib
import signal
import sys

import click

from wentry_cli import __version__
from wentry_cli.cli.streams import give_up_output, open_missing_streams, why_unwritable
from wentry_cli.errors import InputError, WentryError

COMMANDS = {
    "process": "measure every drop of a folder of videos: frames, outlines, cavity, stretch, kinematics",
    "fit": "model, numbers of each drop, regressions over the campaign",
    "report": "one HTML page, a PDF and every figure as SVG, PNG and CSV",
    "run": "process, fit and report in a row",
    "calibrate": "material parameters from rigid-surface drops or a compression test",
    "render": "synthetic drops with their truth",
    "info": "what a recording is: format, size, depth, frame rate and where it came from",
    "check": "validate configuration and input, do nothing else",
    "init": "write an experiment.yaml to fill in",
    "status": "which stage of which drop is fresh, stale or failed, and why",
    "compare": "errors of results against a rendered truth or a hand-tracked table",
    "bench": "speed against error, ours and others'",
    "doctor": "versions, codecs, a second OpenCV",
}
INTERRUPTED = 130
ENDED_BY_SIGNAL = 128  # and the number of the signal


class _Commands(click.Group):
    """A group that imports a command only when it is called, so that ``--help`` answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The commands in the order of the work."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """Import the command ``name`` from its file."""
        del ctx
        if name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"wentry_cli.cli.{name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Offer the nearest command for a misspelt one."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            import difflib

            near = difflib.get_close_matches(args[0], COMMANDS, n=1)
            hint = f"Did you mean '{near[0]}'?" if near else f"The commands are: {', '.join(COMMANDS)}."
            raise click.UsageError(f"No such command '{args[0]}'. {hint}", ctx)
        return super().resolve_command(ctx, args)


@click.command(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(__version__, prog_name="wentry")
def cli() -> None:
    """From high-speed video of a sphere hitting water to physics.

    A drop is a folder with an experiment.yaml; a campaign is a folder of drops. Start with `wentry init FOLDER`, then
    `wentry check FOLDER` and `wentry run FOLDER`. `wentry COMMAND --help` tells the options.
    """


def run(words: list[str] | None = None) -> int:
    """Run the command line with ``words`` (default: those of the process) and return its exit code."""
    try:
        code = cli.main(words, prog_name="wentry", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.exceptions.Abort, KeyboardInterrupt):
        click.echo("interrupted; run the same command again to go on where it stopped", err=True)
        return INTERRUPTED
    except WentryError as error:
        if str(error):
            click.echo(str(error), err=True)
        return error.exit_code
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except OSError as error:
        sentence = why_unwritable(error)
        if sentence is None:
            raise
        give_up_output()
        with contextlib.suppress(OSError):  # stderr may lie on the same full disk
            click.echo(sentence, err=True)
        return InputError.exit_code
    return code if isinstance(code, int) else 0


def main() -> None:
    """Run the command line and leave with its exit code; a termination ends the drops in other processes too.

    So does the end of the terminal, unless it was asked to be outlived (``nohup``).
    """
    open_missing_streams()
    signal.signal(signal.SIGTERM, _end)
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        signal.signal(signal.SIGHUP, _end)
    sys.exit(run())


def _end(number: int, _: object) -> None:
    sys.exit(ENDED_BY_SIGNAL + number)


if __name__ == "__main__":
    main()
