"""`m2pem debug`: a rehearsal that is stopped, looked at, changed, and taken back."""

import cmd
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from m2pem.cli.options import (
    answers_option,
    data_option,
    example,
    fleet_option,
    mission_argument,
    path_option,
    process_option,
    read_data,
)

if TYPE_CHECKING:
    from m2pem.mission.values import Value
    from m2pem.rehearsal.debugging import DebugSession


@click.command(
    epilog=example(
        "m2pem debug missions/vignette1.bpmn --fleet fleet_configs/vignette1.yaml "
        "--break DriveRoute"
    )
)
@mission_argument
@fleet_option(required=False)
@process_option
@path_option
@data_option
@answers_option
@click.option(
    "--break",
    "elements",
    multiple=True,
    metavar="ELEMENT",
    help="Go on at once, and stop where a token has come to it.",
)
@click.option(
    "--when",
    "conditions",
    multiple=True,
    metavar="CONDITION",
    help="Go on at once, and stop when it has become true.",
)
@click.option(
    "--command",
    "commands",
    multiple=True,
    metavar="TEXT",
    help="Do this before commands are read. Can be given again.",
)
def debug(
    mission: str,
    fleet_file: str | None,
    process: str | None,
    search_path: tuple[Path, ...],
    data: "dict[str, Value]",
    answers: Path | None,
    elements: tuple[str, ...],
    conditions: tuple[str, ...],
    commands: tuple[str, ...],
) -> None:
    """Rehearse a mission step by step: stop, look, change, go back.

    Commands are read from standard input; `help` lists them. While it is stopped, time does not
    advance.
    """
    from m2pem.cli.arguments import get_answers
    from m2pem.executive.loading import load_source
    from m2pem.plugins import PluginManager
    from m2pem.rehearsal.debugging import DebugSession
    from m2pem.scripting.sources import fleet_of

    loaded = load_source(mission, search_path)
    fleet = fleet_of(fleet_file, loaded) if fleet_file is not None else None
    session = DebugSession(
        loaded,
        fleet,
        plugins=PluginManager(),
        process=process,
        data=data,
        answers=get_answers(answers, loaded),
    )
    with session:
        shell = DebugShell(session)
        if elements or conditions:
            session.set_breakpoints(elements, conditions)
            shell.do_continue("")
        else:
            shell.show_place()
        if not any(shell.onecmd(each) for each in commands):
            shell.cmdloop()


class DebugShell(cmd.Cmd):
    """Reads commands, and prints what they find. Errors are printed, and end nothing."""

    doc_header = "Commands (help COMMAND says more):"

    def __init__(self, session: "DebugSession") -> None:
        from m2pem.cli.line_formatter import LineFormatter

        super().__init__()
        self._session = session
        self._shown = 0
        self._lines = LineFormatter(lambda _: session.mission, colour=sys.stdout.isatty())
        self.use_rawinput = sys.stdin.isatty()
        self.prompt = "(m2pem) " if sys.stdin.isatty() else ""

    # --- going on ---------------------------------------------------------------------------------

    def do_step(self, text: str) -> None:
        """step [N]: execute one token, or N one after the other. Where all tokens wait, time goes
        on until one moves."""
        times = int(text) if text else 1
        for _ in range(times):
            self._session.step()
            if self._session.ended:
                break
        self._show_new()

    def do_continue(self, _: str) -> None:
        """continue: go on to the next breakpoint, or to the end."""
        self._session.resume()
        self._show_new()

    def do_back(self, text: str) -> None:
        """back [N | T s]: go back to the stop before, to the Nth before, or to a mission time.
        What was changed there or later is undone."""
        session = self._session
        stops = session.stops
        if text.endswith("s"):
            moment = session.moment_at(float(text[:-1]))
        else:
            before = [each.moment for each in stops if each.moment < stops[-1].moment]
            number = int(text) if text else 1
            moment = before[-number] if number <= len(before) else 0
        session.go_back(moment)
        self._shown = len(session.records)
        self.show_place()

    # --- breakpoints ------------------------------------------------------------------------------

    def do_break(self, text: str) -> None:
        """break [ELEMENT ... | when CONDITION]: stop where a token has come to an element, before
        it does anything, or when a condition over the data has become true. Alone: list them."""
        session = self._session
        there = session.breakpoints
        word, _, condition = text.partition(" ")
        if word == "when":
            session.set_breakpoints(there.elements, (*there.conditions, condition.strip()))
        elif text:
            session.set_breakpoints((*there.elements, *shlex.split(text)), there.conditions)
        there = session.breakpoints
        for element in there.elements:
            print(f"  {element} ({session.view.label(element)})")
        for condition in there.conditions:
            print(f"  when {condition}")
        if not there.elements and not there.conditions:
            print("  no breakpoints")

    def do_clear(self, text: str) -> None:
        """clear [ELEMENT | CONDITION]: delete a breakpoint, or all."""
        session = self._session
        there = session.breakpoints
        left = [
            [each for each in kind if text and each != text]
            for kind in (there.elements, there.conditions)
        ]
        session.set_breakpoints(*left)

    # --- looking ----------------------------------------------------------------------------------

    def do_where(self, _: str) -> None:
        """where: the elements with tokens, and what they wait for."""
        view = self._session.view
        for active in view.active():
            waits = [f"{each.name} of {', '.join(each.resources)}" for each in active.behaviors]
            waits += [
                f"an answer: {prompt.text}"
                for prompt in view.prompts.values()
                if prompt.element == active.element
            ]
            tokens = f" x {active.tokens}" if active.tokens > 1 else ""
            label = view.label(active.element)
            named = f" ({label})" if label != active.element else ""
            print(f"  {active.element}{named}{tokens}{': ' if waits else ''}{'; '.join(waits)}")
        self.show_place()

    def do_data(self, _: str) -> None:
        """data: the data of the data stores and of each active process, subprocess and task."""
        for each in self._session.data():
            if not each.data:
                continue
            label = self._session.view.label(each.element)
            instance = "" if each.instance is None else f", instance {each.instance}"
            print(f"  {each.element} ({label}){instance}:" if each.element else "  data stores:")
            for name, value in each.data.items():
                print(f"    {name} = {value!r}")

    def do_print(self, text: str) -> None:
        """print EXPRESSION: its value as the element sees it that is next, and of which kind it is.
        The language is the one of its marks: '= x' is FEEL, '${x}' JUEL."""
        print(f"  {self._session.evaluate(text)}")

    def complete_print(self, text: str, *_: object) -> list[str]:
        """Complete names of the data."""
        names = {name for each in self._session.data() for name in each.data}
        return sorted(name for name in names if name.startswith(text))

    def do_vehicles(self, _: str) -> None:
        """vehicles: where they are, and what they do."""
        for name, state in self._session.here.states.items():
            place = getattr(state, "position", None)
            where = (
                f"{place.latitude_deg:.6f} {place.longitude_deg:.6f} {place.altitude_m:.0f} m"
                if place is not None
                else ""
            )
            print(f"  {name}: {state.behavior or 'at rest'} {where}".rstrip())

    def do_records(self, text: str) -> None:
        """records [N]: the last records, 20 if not said, as they are in a journal."""
        for stamped in self._session.records[-(int(text) if text else 20) :]:
            print(f"  {stamped.seq:5} {stamped.t_s:9.1f} s  {stamped.record}")

    # --- changing ---------------------------------------------------------------------------------

    def do_set(self, text: str) -> None:
        """set NAME=VALUE ...: change data, as the element sees it that is next."""
        from m2pem.engine.inputs import SetData

        reached = self._session.here.reached
        scope = reached.scope if reached is not None else 0
        self._session.change(SetData(read_data(shlex.split(text)), scope, "debugger"))

    def do_answer(self, text: str) -> None:
        """answer ELEMENT DECISION: decide so when this user task asks next."""
        element, decision = self._words(text, "ELEMENT", "DECISION")
        self._script(answers={element: [decision]})

    def do_end(self, text: str) -> None:
        """end ELEMENT succeeded|failed|lost|stalled [SECONDS [ERROR]]: how the next behavior of a
        task ends, and after how many seconds."""
        element, end, *more = shlex.split(text) if text else [""]
        entry: dict[str, object] = {"end": end, "after": float(more[0]) if more else 0.0}
        if more[1:]:
            entry["error"] = more[1]
        self._script(behaviors={element: [entry]})

    def do_service(self, text: str) -> None:
        """service ELEMENT NAME=VALUE ... | error CODE: what the service of a task does next."""
        element, *more = shlex.split(text)
        if more[:1] == ["error"]:
            self._script(services={element: [{"error": more[1]}]})
        else:
            self._script(services={element: [{"write": read_data(more)}]})

    def do_signal(self, text: str) -> None:
        """signal ID [NAME=VALUE ...]: let a signal come now."""
        from m2pem.engine.inputs import SignalReceived

        name, *data = shlex.split(text)
        signals = self._session.mission.signals
        found = [key for key, each in signals.items() if name in (key, each.name)]
        self._session.change(
            SignalReceived(found[0] if found else name, read_data(data), "debugger")
        )

    def _script(self, **sections: object) -> None:
        from m2pem.rehearsal.answers_file import AnswersModel

        self._session.change(AnswersModel.model_validate(sections))

    @staticmethod
    def _words(text: str, *names: str) -> list[str]:
        words = shlex.split(text)
        if len(words) != len(names):
            raise ValueError(f"it takes {' '.join(names)}")
        return words

    # --- the shell --------------------------------------------------------------------------------

    def do_quit(self, _: str) -> bool:
        """quit: end."""
        return True

    def do_EOF(self, _: str) -> bool:  # noqa: N802  # the name is that of `cmd.Cmd`
        """End of input: quit."""
        return True

    def emptyline(self) -> bool:
        """Nothing is repeated: a step more by mistake could be undone, but would surprise."""
        return False

    def onecmd(self, line: str) -> bool:
        """Do one command; its error is printed."""
        from pydantic import ValidationError

        from m2pem.errors import M2pemError

        try:
            return bool(super().onecmd(line))
        except ValidationError as error:
            print("; ".join(str(each["msg"]) for each in error.errors()))
        except (M2pemError, ValueError, IndexError, click.ClickException) as error:
            print(error.message if isinstance(error, click.ClickException) else error)
        return False

    def default(self, line: str) -> None:
        """Say what there is."""
        from m2pem.suggestions import suggest

        known = [name.removeprefix("do_") for name in self.get_names() if name[:3] == "do_"]
        word = line.split(maxsplit=1)[0]
        print(f"there is no command {word!r}; {suggest(word, sorted(known), 'commands')}")

    def completenames(self, text: str, *_: object) -> list[str]:
        """Complete names of commands; `do_EOF` is none."""
        return [name for name in super().completenames(text) if name != "EOF"]

    def completedefault(self, text: str, *_: object) -> list[str]:
        """Complete ids of elements."""
        return [node.id for node in self._session.mission.nodes if node.id.startswith(text)]

    def show_place(self) -> None:
        """Print where it is, and why it is there."""
        here = self._session.here
        if here.reached is None:
            summary = here.summary
            print(f"the run has ended: {summary.status.value} {summary.detail}".rstrip())
            return
        from m2pem.api.description import describe
        from m2pem.api.runs import StampedRecord

        view = self._session.view
        stamped = StampedRecord(view.run, view.seq, here.t_s, here.reached)
        print(f"{here.t_s:9.1f} s  {describe(stamped, view).text}")

    def _show_new(self) -> None:
        from m2pem.rehearsal.debugging import OF_DEBUGGING

        records = self._session.records
        for stamped in records[self._shown :]:
            line = self._lines.format(stamped)
            if line is not None and not isinstance(stamped.record, OF_DEBUGGING):
                print(line)
        self._shown = len(records)
        self.show_place()
