"""Commanding one behavior of a vehicle or payload, outside of any mission."""

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rich.text import Text
from textual import work

from m2pem.api import (
    Area,
    BehaviorSpec,
    BehaviorType,
    ParameterKind,
    ParameterSpec,
    Point,
    ResourceId,
    Route,
)
from m2pem.errors import M2pemError
from m2pem_plugin_terminal.dialogs import Choice, Choose, Confirm, Read
from m2pem_plugin_terminal.form import Field, Form
from m2pem_plugin_terminal.formatting import shortened
from m2pem_plugin_terminal.handover import choices, effects_text, with_operator
from m2pem_plugin_terminal.taking import Taking

if TYPE_CHECKING:
    from m2pem.api import Fleet

TITLE = "Command a vehicle or payload"
TAKEN_FIRST = "You take {resource} first, and have it until you give it back (t)."
COMMON = ("hold", "goto", "return_to_launch", "takeoff", "land", "set_speed", "drive_stop")
"""Behaviors that come first in the list."""

HINTS = {
    ParameterKind.DURATION: "10 s",
    ParameterKind.DISTANCE: "5 m",
    ParameterKind.ALTITUDE: "20 m",
    ParameterKind.SPEED: "5 m/s",
    ParameterKind.ANGLE: "90 deg",
    ParameterKind.ANGULAR_SPEED: "10 deg/s",
    ParameterKind.NUMBER: "a number",
    ParameterKind.COUNT: "a whole number",
    ParameterKind.BOOLEAN: "true or false",
    ParameterKind.ROUTE: "name of a route",
    ParameterKind.AREA: "name of an area",
    ParameterKind.POSITION: "latitude, longitude, or the name of a point or vehicle",
    ParameterKind.VEHICLE: "name of a vehicle",
}
GEOMETRIES = {
    ParameterKind.ROUTE: (Route,),
    ParameterKind.AREA: (Area,),
    ParameterKind.POSITION: (Point,),
}
_COORDINATES = re.compile(r"-?\d+(\.\d+)?([,\s]\s*-?\d+(\.\d+)?){1,2}")


def behavior_choices(specs: Sequence[BehaviorSpec]) -> list[Choice]:
    """Return a line for each behavior of a single vehicle or payload, the common ones first."""
    own = [each for each in specs if each.type is not BehaviorType.TEAM]
    order = {name: place for place, name in enumerate(COMMON)}
    own.sort(key=lambda each: order.get(each.name, len(order)))
    return [Choice(each.name, each.name, shortened(each.doc, 36)) for each in own]


def fields(spec: BehaviorSpec, fleet: "Fleet") -> list[Field]:
    """Return a field for each parameter, those that must be given first."""
    parameters = sorted(spec.parameters, key=lambda each: not each.required)
    return [
        Field(each.name, _hint(each), each.required, _suggestions(each, fleet))
        for each in parameters
    ]


def _hint(parameter: ParameterSpec) -> str:
    hint = ", ".join(parameter.choices) or HINTS.get(parameter.kind, "")
    if parameter.default is not None:
        hint = f"{hint}; else {parameter.default}" if hint else f"else {parameter.default}"
    return hint


def _suggestions(parameter: ParameterSpec, fleet: "Fleet") -> tuple[str, ...]:
    wanted = GEOMETRIES.get(parameter.kind, ())
    names = [name for name, each in fleet.geometries.items() if isinstance(each, wanted)]
    if parameter.kind in (ParameterKind.VEHICLE, ParameterKind.POSITION):
        names += fleet.vehicles
    return (*parameter.choices, *names)


def parameters(values: Mapping[str, str]) -> dict[str, str]:
    """Return what was typed as a mission has it: empty fields are left out, and "38.1, -77.3"
    becomes "[38.1, -77.3]"."""
    given = {name: text.strip() for name, text in values.items() if text.strip()}
    for name, text in given.items():
        if _COORDINATES.fullmatch(text):
            given[name] = f"[{', '.join(text.replace(',', ' ').split())}]"
    return given


class DirectCommands(Taking):
    """The key that commands a behavior."""

    @work(exit_on_error=False)
    async def action_command(self) -> None:
        """Choose a vehicle or payload, a behavior and its parameters; `y` commands it."""
        try:
            holders = await self.control.holders()
            labels = await self.control.holder_labels()

            def task(holder: str) -> str:
                return self.task_label(holder) or labels.get(holder, holder)

            listed = choices(self.control.fleet(), holders, self.by, task)
            resource = await self.push_screen_wait(Choose(TITLE, listed))
            if resource is not None:
                await self._command_of(resource, holders.get(ResourceId(resource), ""))
        except M2pemError as error:
            self.say(f"Not commanded: {error}", alarm=True)

    async def _command_of(self, resource: str, holder: str) -> None:
        if with_operator(holder) and holder != self.by:
            self.say(f"{resource} is with {holder}", alarm=True)
            return
        specs = {each.name: each for each in self.control.catalogue()[ResourceId(resource)]}
        listed = behavior_choices(list(specs.values()))
        behavior = await self.push_screen_wait(Choose(f"What shall {resource} do?", listed))
        if behavior is None:
            return
        asked = fields(specs[behavior], self.control.fleet())
        values: Mapping[str, str] | None = {}
        while True:
            if asked:
                title = f"{resource}: {behavior}"
                form = Form(title, specs[behavior].doc, asked, values or {})
                values = await self.push_screen_wait(form)
            if values is None:
                return
            problem = await self._confirmed(resource, behavior, parameters(values))
            if not problem:
                return
            title = f"{behavior} of {resource} was not commanded"
            await self.push_screen_wait(Read(title, Text(problem)))
            if not asked:
                return

    async def _confirmed(self, resource: str, behavior: str, given: Mapping[str, str]) -> str:
        """Command it, once the operator has read what that ends; return what is wrong with it."""
        holder = (await self.control.holders()).get(ResourceId(resource), "")
        of_mission = bool(holder) and not with_operator(holder) and not self._own_command(holder)
        words = " ".join((behavior, *(f"{name}={value}" for name, value in given.items())))
        text = Text(f"{words}\n", "bold #e3e8ee")
        if of_mission:
            text.append_text(effects_text(resource, await self.control.preview_take(resource)))
            text.append(f"\n{TAKEN_FIRST.format(resource=resource)}", "#e8c468")
        elif self._own_command(holder):
            text.append(f"In place of {self.task_label(holder) or holder}.", "#9aa4af")
        if not await self.push_screen_wait(Confirm(f"Command {resource}?", text)):
            return ""
        try:
            if of_mission:
                await self.control.take(resource, by=self.by)
            run = await self.control.execute_behavior(resource, behavior, given, by=self.by)
        except M2pemError as error:
            return str(error)
        self.say(f"{resource}: {words} is commanded ({run})")
        return ""

    def _own_command(self, holder: str) -> bool:
        """Return whether a resource does what an operator commanded outside of a mission."""
        view = self.follower.views.get(holder.rpartition(".")[0])
        return view is not None and view.is_command
