"""The top command `m2pem`: its lazily loaded commands, its log, and its exit status."""

import builtins
import logging
import os
import sys
from collections.abc import Sequence
from copy import copy
from functools import cached_property
from importlib import import_module
from keyword import iskeyword
from typing import TYPE_CHECKING

import click

import m2pem
from m2pem.cli.notes import say
from m2pem.cli.ros_arguments import ros_arguments
from m2pem.errors import M2pemError
from m2pem.findings import escaped
from m2pem.suggestions import did_you_mean

if TYPE_CHECKING:
    from m2pem.plugins import PluginManager

COMMANDS = {
    "init": "Make a folder with a mission, a fleet, answers and a README.",
    "examples": "List the examples, or copy one.",
    "demo": "Show missions on simulated vehicles.",
    "run": "Run a mission to its end.",
    "serve": "Serve operators, who start missions, until stopped.",
    "gateway": "Show a fleet to programs of other protocols, without operators.",
    "arbiter-host": "Run the arbiters of vehicles on this host, for an executive elsewhere.",
    "start": "Start a mission in an executive that is running on this host.",
    "approve": "Approve a mission: exactly the content that its files and drawings have now.",
    "schedule": "Show the missions that start later; cancel, hold or release them.",
    "check": "Check a mission file, alone or against a fleet.",
    "verify": "Prove properties and requirements of a mission, or show a run that violates them.",
    "simulate": "Rehearse a mission on a virtual clock.",
    "test": "Rehearse the scenarios of missions, and say what they never see.",
    "debug": "Rehearse a mission step by step: stop, look, change, go back.",
    "campaign": "Rehearse a mission many times, with faults and times that are drawn.",
    "runs": "List the runs of a journal.",
    "export": "Export runs for other programs.",
    "journal": "Show the state of a journal, check it, back it up, salvage or compact it.",
    "replay": "Print the records of a run, and its state.",
    "explain": "Explain which vehicles a task got, and why.",
    "resume": "Take up a run that was interrupted.",
    "answer": "Answer a prompt of a run that is running on this host.",
    "incidents": "List the errors about which operators must decide.",
    "resolve": "Decide about an incident of a run that is running on this host.",
    "revise": "Go on with a new version of a mission that is running on this host.",
    "take": "Take a vehicle or payload from the missions, to steer it by hand.",
    "give-back": "Give a vehicle or payload that an operator has taken back to the missions.",
    "alerts": "List what operators must know now.",
    "acknowledge": "Note that you have seen alerts.",
    "own": "Note who takes care of alerts.",
    "signal": "Send a signal to a run that is running on this host.",
    "stop": "Stop a run that is running on this host, or all of them.",
    "pause": "Pause a run that is running on this host.",
    "continue": "Let a run on this host go on after a pause.",
    "break": "Set the breakpoints of a run that is running on this host.",
    "step": "Execute one step of a paused run on this host.",
    "data": "Print the data of a run that is running on this host.",
    "set": "Change data of a paused run on this host.",
    "hand-over": "Give a vehicle or payload to the operator who asks for it, or refuse.",
    "operators": "List the operators who are present, and who asks whom for what.",
    "note": "Write a note into the log of a run that is running on this host.",
    "switchover": "Have the executive of this host leave its runs to the one that stands by.",
    "attach": "Serve an operator of an executive that is running on this host.",
    "plugins": "List the plugins and what they provide.",
    "fleet": "Show a fleet: who is there and can do what.",
    "geometries": "List routes, areas and points; show, export, import, delete and restore them.",
    "doctor": "Check this host: what is right, and what to do about the rest.",
    "templates": "Make forms of a fleet's behaviors for BPMN editors.",
    "completion": "Print what makes a shell complete m2pem's words.",
}
"""Built-in commands and the first lines of their help."""


_RUN_CONTROL = frozenset({"answer", "continue", "note", "pause", "signal", "stop"})
_MODULES = {
    **dict.fromkeys(_RUN_CONTROL, "run_control"),
    "resolve": "incidents",
    "give-back": "take",
    "acknowledge": "alerts",
    "own": "alerts",
    **dict.fromkeys(("break", "step", "data", "set"), "breakpoints"),
    "hand-over": "take",
}


def built_in(name: str) -> click.Command:
    """Return the built-in command of that name; the function `continue_` is `m2pem continue`, and
    `set_` is `m2pem set`."""
    module = _MODULES.get(name, name.replace("-", "_"))
    function = f"{name}_" if iskeyword(name) or hasattr(builtins, name) else name.replace("-", "_")
    command = getattr(import_module(f"m2pem.cli.{module}"), function)
    assert isinstance(command, click.Command)
    return command


class LazyGroup(click.Group):
    """A group that imports a built-in command when it is called, and asks the plugins last.

    `--help` shows built-in commands by `COMMANDS`, so that it loads none of them.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Built-in commands, then those of plugins."""
        return [*COMMANDS, *sorted(self._of_plugins.commands)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of that name; None if there is none."""
        if cmd_name in COMMANDS:
            return built_in(cmd_name)
        return self._of_plugins.commands.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click's; the error for an unknown command names broken plugins that may have it."""
        name = args[0]
        if not name.startswith("-") and self.get_command(ctx, name) is None:
            raise click.UsageError(self._unknown(ctx, name), ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of commands in `--help`."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))
        if added := self._of_plugins.commands:
            with formatter.section("Commands of plugins"):
                formatter.write_dl(
                    [(name, added[name].get_short_help_str(70)) for name in sorted(added)]
                )

    def _unknown(self, ctx: click.Context, name: str) -> str:
        """There is no such command; if a plugin is broken, it may have had it."""
        known = self.list_commands(ctx)
        hint = did_you_mean(name, known) or f"there are: {', '.join(known)}"
        broken = "".join(f"\n{failure}" for failure in self._plugins.failures)
        return f"there is no command {name!r}; {hint}{broken}"

    @cached_property
    def _plugins(self) -> "PluginManager":
        from m2pem.plugins import PluginManager

        return PluginManager()

    @cached_property
    def _of_plugins(self) -> click.Group:
        group = built_in_names()
        self._plugins.commands(group)
        return group


def built_in_names() -> click.Group:
    """Return a group for the commands of plugins, in which the built-in names are taken."""
    return _Names("m2pem")


class _Names(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*COMMANDS, *self.commands]


@click.group(
    cls=LazyGroup,
    epilog="Each command shows an example with --help. The guide is docs/cli.md.",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(m2pem.__version__, prog_name="m2pem")
@click.option("--debug", is_flag=True, help="Log everything, and show tracebacks.")
@click.option("--quiet", is_flag=True, help="Print no notes, no progress and no warnings of files.")
@click.option(
    "--log-format",
    type=click.Choice(["plain", "json"]),
    default="plain",
    show_default=True,
    help="How log, notes and errors look at standard error; json: an object a line.",
)
def cli(debug: bool, quiet: bool, log_format: str) -> None:  # `quiet` is read by m2pem.cli.notes
    """Plan, check, rehearse and run missions of unmanned vehicles, drawn in BPMN 2.0."""
    _log_to_stderr(logging.DEBUG if debug else logging.WARNING, log_format)


def _log_to_stderr(level: int, log_format: str) -> None:
    handler = logging.StreamHandler()
    if log_format == "json":
        from m2pem.cli.log_format import JsonFormatter

        handler.setFormatter(JsonFormatter(tracebacks=level == logging.DEBUG))
    else:
        formatter = logging.Formatter if level == logging.DEBUG else _WithoutTracebacks
        handler.setFormatter(formatter("%(levelname)s %(name)s: %(message)s"))
    logger = logging.getLogger("m2pem")
    logger.handlers[:] = [handler]
    logger.propagate = False
    logger.setLevel(level)


def log_from_a_thread() -> None:
    """Write the log from a thread: a full pipe at standard error must not delay a mission."""
    from m2pem.cli.standard_streams import writer_for

    class Lines(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            writer_for(sys.stderr).put(self.format(record))

    logger = logging.getLogger("m2pem")
    lines = Lines()
    lines.setFormatter(logger.handlers[0].formatter if logger.handlers else None)
    logger.handlers[:] = [lines]


class _WithoutTracebacks(logging.Formatter):
    """Says in the same line what was raised."""

    def format(self, record: logging.LogRecord) -> str:
        error = record.exc_info[1] if record.exc_info else None
        short = copy(record)
        short.exc_info = short.exc_text = short.stack_info = None
        text = super().format(short)
        return text if error is None else f"{text}: {type(error).__name__}: {error}"


STOPPED = 130
"""Exit status when an operator stopped it (a shell's 128 + SIGINT)."""


def run_command_line(arguments: Sequence[str] | None = None) -> int:
    """Carry out a command line (that of the process by default); returns the exit status.

    0 well, 1 failed, 2 unusable input, 130 stopped. No exception comes out but with `--debug`.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with ros_arguments(words) as rest:
            result = cli.main(rest, prog_name="m2pem", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        return STOPPED
    except BrokenPipeError:
        ignore_closed_stdout()
        return 1
    except M2pemError as error:
        if _debugging():
            logging.getLogger("m2pem").exception("it ended with this error")
        say(f"m2pem: {escaped(str(error), keep=chr(10))}")
        return error.exit_status
    except Exception as error:
        if _debugging():
            raise
        what = " ".join(f"{type(error).__name__}: {error}".split())
        click.echo(
            f"m2pem: this is a bug in m2pem: {what}\n"
            "Please report it, with what `m2pem --debug` and the same command print.",
            err=True,
        )
        return 1
    return result if isinstance(result, int) else 0


def ignore_closed_stdout() -> None:
    """Redirect standard output, whose reader has ended, so that Python ends without an error."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


def _debugging() -> bool:
    return logging.getLogger("m2pem").isEnabledFor(logging.DEBUG)
