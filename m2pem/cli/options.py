"""Options that several commands have."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from m2pem.cli.completers import (
    faces,
    file_or,
    operator_units,
    processes_of_mission,
    runs_of_journal,
)
from m2pem.errors import M2pemError

if TYPE_CHECKING:
    from m2pem.mission.values import Value

F = TypeVar("F", bound=Callable[..., Any])


class UnusableError(M2pemError):
    """A file or value of the command line is missing or cannot be used."""

    exit_status = 2


@contextmanager
def writing(file: Path) -> Iterator[None]:
    """Within the block, an error of the disk says that `file` cannot be written.

    Raises:
        UnusableError: that.
    """
    try:
        yield
    except OSError as error:
        raise UnusableError(f"{file} cannot be written: {error.strerror or error}") from error


mission_argument = click.argument("mission", shell_complete=file_or())

run_argument = click.argument("run_id", metavar="RUN", shell_complete=runs_of_journal(ended=False))

optional_run_argument = click.argument(
    "run_id", metavar="[RUN]", required=False, shell_complete=runs_of_journal(ended=False)
)

format_option = click.option(
    "--format",
    "output",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="Print for people, or for programs.",
)

run_on_option = click.option(
    "--run-on",
    metavar="EXECUTIVE",
    help="Which executive, if several write to the journal: its process id or its fleet's name.",
)
journal_option = click.option(
    "--journal",
    metavar="URL",
    shell_complete=file_or("memory:"),
    help="Where runs are kept: a path, postgresql://user@host/database or memory:  "
    "[default: m2pem/journal.db in $XDG_STATE_HOME or ~/.local/state]",
)


def fleet_option(*, required: bool) -> Callable[[F], F]:
    """`--fleet`; `required` where a mission cannot do without."""
    return click.option(
        "--fleet",
        "fleet_file",
        metavar="FLEET",
        required=required,
        shell_complete=file_or("sim"),
        help="The fleet file; `sim` makes vehicles up for the mission.",
    )


spec_option = click.option(
    "--spec",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Requirements (YAML) beside those in the mission's own file.",
)

process_option = click.option(
    "--process",
    metavar="ID",
    shell_complete=processes_of_mission,
    help="The process to begin with  [default: the mission's main one]",
)


def read_data(words: Sequence[str]) -> "dict[str, Value]":
    """Return what words NAME=VALUE say; a value is YAML 1.2.

    Raises:
        click.BadParameter: one is wrong, or a name is given twice.
    """
    if not words:
        return {}
    from m2pem.api.data_text import named_value
    from m2pem.errors import OperatorError

    data: dict[str, Value] = {}
    for word in words:
        try:
            name, value = named_value(word)
        except OperatorError as error:
            raise click.BadParameter(str(error)) from None
        if name in data:
            raise click.BadParameter(f"{name} is given twice")
        data[name] = value
    return data


def _data_option(data: str) -> Callable[[F], F]:
    return click.option(
        "--data",
        metavar="NAME=VALUE",
        multiple=True,
        callback=lambda _, __, words: read_data(words),
        help=f"Data that {data}; the value is YAML 1.2. Can be given again.",
    )


data_option = _data_option("the mission starts with")

signal_data_option = _data_option("the signal brings")

incident_data_option = _data_option("set_data writes")

path_option = click.option(
    "--path",
    "search_path",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="DIR",
    multiple=True,
    help="A folder of processes that missions call, after the mission's own and before those of "
    "M2PEM_PATH. Can be given again.",
)

answers_option = click.option(
    "--answers",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Script operators, services, signals and behaviors from this file.",
)

ocu_option = click.option(
    "--ocu",
    "ocu_names",
    metavar="NAMES",
    shell_complete=operator_units,
    help="Operator control units, separated by commas; none for no unit  "
    "[default: terminal if it is installed and this is one, else plain]",
)

face_option = click.option(
    "--face",
    "face_names",
    metavar="NAMES",
    shell_complete=faces,
    help="Faces for programs of other protocols, separated by commas; none for no face  "
    "[default: those of the fleet file]",
)

speed_option = click.option(
    "--speed",
    type=click.FloatRange(min=0, min_open=True, max=1_000_000),
    default=1.0,
    show_default=True,
    help="Of simulated vehicles and timers against the wall clock.",
)

simulate_option = click.option(
    "--simulate", is_flag=True, help="Simulate every vehicle and payload of the fleet."
)


def example(text: str) -> str:
    """The end of a command's help: one example."""
    return f"\b\nExample:\n  {text}"


def as_json(value: object) -> str:
    """JSON for programs, spread over lines so that people can read it too."""
    import msgspec

    return msgspec.json.format(msgspec.json.encode(value), indent=2).decode()
