"""Plays one case with SpiffWorkflow, by its own interface: JSON in, JSON out.

Run by its own interpreter, which has SpiffWorkflow and not m2pem. This is the application around
the engine: it does the tasks that people do, begins processes that are started by a message or a
signal, and carries events between instances.
"""

import io
import json
import sys
from datetime import UTC, datetime, timedelta, tzinfo
from types import SimpleNamespace
from typing import Any

from SpiffWorkflow.bpmn.parser import BpmnParser
from SpiffWorkflow.bpmn.parser.ValidationException import ValidationException
from SpiffWorkflow.bpmn.script_engine import PythonScriptEngine, TaskDataEnvironment
from SpiffWorkflow.bpmn.specs.event_definitions import timer
from SpiffWorkflow.bpmn.specs.event_definitions.conditional import ConditionalEventDefinition
from SpiffWorkflow.bpmn.specs.event_definitions.item_aware_event import SignalEventDefinition
from SpiffWorkflow.bpmn.specs.event_definitions.message import MessageEventDefinition
from SpiffWorkflow.bpmn.specs.mixins import ServiceTaskMixin, StartEventMixin, UserTaskMixin
from SpiffWorkflow.bpmn.specs.mixins.events.intermediate_event import BoundaryEvent
from SpiffWorkflow.bpmn.util import BpmnEvent
from SpiffWorkflow.bpmn.workflow import BpmnWorkflow
from SpiffWorkflow.task import Task
from SpiffWorkflow.util.task import TaskState

Data = dict[str, Any]

START = datetime(2026, 1, 1, tzinfo=UTC)
A_MOMENT = timedelta(milliseconds=1)  # a timer of SpiffWorkflow fires when its time has passed
TICKS = 60  # in how many steps time goes on, so that timers fire in their order
ENTERED = TaskState.READY | TaskState.STARTED | TaskState.WAITING | TaskState.FINISHED_MASK


class Clock(datetime):
    """The clock that timers look at."""

    at = START

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> "Clock":
        return cls.fromtimestamp(Clock.at.timestamp(), tz)


class Null:
    """A name without a value, as in m2pem: None, and neither more nor less than anything."""

    def __eq__(self, other: object) -> bool:
        return other is None or isinstance(other, Null)

    def __hash__(self) -> int:
        return 0

    def __bool__(self) -> bool:
        return False

    def _no(self, other: object) -> bool:
        return False

    def _null(self, other: object) -> "Null":
        return self

    __lt__ = __le__ = __gt__ = __ge__ = _no
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _null


class Names(dict[str, Any]):
    """Data as expressions see them."""

    def __missing__(self, name: str) -> Null:
        if name.startswith("__"):
            raise KeyError(name)
        return Null()

    @classmethod
    def of(cls, *contexts: Data | None) -> "Names":
        known = {name: value for context in contexts for name, value in (context or {}).items()}
        return cls({name: value for name, value in known.items() if value is not None})


class Environment(TaskDataEnvironment):
    def evaluate(self, expression: str, context: Data, external_context: Data | None = None) -> Any:
        found = eval(expression, {}, Names.of(external_context, context))
        return None if isinstance(found, Null) else found

    def execute(self, script: str, context: Data, external_context: Data | None = None) -> bool:
        names = Names.of(external_context, context)
        try:
            exec(script, {}, names)
        finally:
            context |= {n: None if isinstance(v, Null) else v for n, v in names.items()}
        return True


class Application:
    def __init__(self, order: Data) -> None:
        self.parser = BpmnParser()
        self.parser.add_bpmn_io(io.BytesIO(order["xml"].encode()))
        self.startable = order["startable"]
        self.instances: list[BpmnWorkflow] = []
        self.seen: set[object] = set()
        self.entered: list[str] = []

    def begin(self, process: str, data: Data) -> BpmnWorkflow:
        workflow = BpmnWorkflow(
            self.parser.get_spec(process),
            self.parser.get_subprocess_specs(process),
            script_engine=PythonScriptEngine(environment=Environment()),
        )
        workflow.get_next_task(spec_name="Start").set_data(**data)
        for name in workflow.data_objects:
            if name in data:
                workflow.data_objects[name] = data[name]
        self.instances.append(workflow)
        return workflow

    def settle(self) -> None:
        """Until nothing moves but what people or time must do."""
        moved = True
        while moved:
            moved = False
            for workflow in list(self.instances):
                workflow.do_engine_steps(did_complete_task=lambda task: self.look())
                self.look()
                for task in workflow.get_tasks(state=TaskState.READY, manual=True):
                    if not isinstance(task.task_spec, UserTaskMixin):
                        task.run()
                        moved = True
                for task in workflow.get_tasks(state=TaskState.STARTED):
                    if isinstance(task.task_spec, ServiceTaskMixin):
                        task.complete()
                        moved = True
                for task in list(workflow.event_manager.tasks.values()):
                    if isinstance(task.task_spec.event_definition, ConditionalEventDefinition):
                        task.task_spec._update(task)
                        moved = moved or task.state == TaskState.READY
                for event in workflow.get_events():
                    moved = self.deliver(event, workflow) or moved
        self.look()

    def deliver(self, event: BpmnEvent, sender: BpmnWorkflow | None) -> bool:
        """A message goes to one receiver, a signal to all; either may begin an instance."""
        to_all = isinstance(event.event_definition, SignalEventDefinition)
        if not to_all and not isinstance(event.event_definition, MessageEventDefinition):
            return False
        found = False
        for workflow in self.instances:
            if workflow is not sender and (to_all or not found):
                found = bool(workflow.event_manager.catch(event, internal=False)) or found
        for process in self.startable:
            if found and not to_all:
                break
            specs = self.parser.get_spec(process).task_specs.values()
            if any(
                isinstance(spec, StartEventMixin)
                and spec.event_definition == event.event_definition
                for spec in specs
            ):
                workflow = self.begin(process, {})
                workflow.do_engine_steps()
                workflow.event_manager.catch(event, internal=False)
                found = True
        return found

    def send(self, event: BpmnEvent) -> None:
        self.deliver(event, None)
        self.settle()

    def look(self) -> None:
        """Note the elements that tasks have been made for since the last look."""
        for workflow in self.instances:
            for task in workflow.get_tasks(state=ENTERED):
                spec = task.task_spec
                if spec.bpmn_id is None:
                    continue
                if isinstance(spec, (BoundaryEvent, StartEventMixin)):
                    self.note_event(task)
                elif task.state != TaskState.CANCELLED and task.id not in self.seen:
                    self.seen.add(task.id)
                    self.entered.append(spec.bpmn_id)

    def note_event(self, task: Task) -> None:
        """Boundary and start events count when they have caught; a cycle has a child a time."""
        firsts = [c for c in task.children if c.task_spec is task.task_spec.outputs[0]]
        rounds = [c.id for c in firsts if c.has_state(ENTERED)]
        if task.state == TaskState.COMPLETED and not rounds:
            rounds = [task.id]
        for each in rounds:
            if (task.task_spec.bpmn_id, each) not in self.seen:
                self.seen.add((task.task_spec.bpmn_id, each))
                self.entered.append(task.task_spec.bpmn_id)

    def advance(self, seconds: float) -> None:
        until = Clock.at + timedelta(seconds=seconds)
        while Clock.at < until:
            Clock.at = min(until, Clock.at + timedelta(seconds=max(seconds / TICKS, 0.5)))
            self.tick(Clock.at)
        self.tick(until)

    def tick(self, at: datetime) -> None:
        Clock.at = at + A_MOMENT
        for workflow in list(self.instances):
            workflow.refresh_timers()
        Clock.at = at
        self.settle()

    def step(self, step: Data, order: Data) -> None:
        verb, name = step["verb"], step["name"]
        if verb == "start":
            self.begin(order["main"], order["given"])
            self.settle()
        elif verb == "answer":
            tasks = [
                task
                for workflow in self.instances
                for task in workflow.get_tasks(state=TaskState.READY, manual=True)
                if task.task_spec.bpmn_id == name
            ]
            if len(tasks) < step["number"]:
                raise LookupError(f"{name} does not wait")
            task = tasks[step["number"] - 1]
            task.data["user"] = SimpleNamespace(decision=step["word"] or "done")
            task.run()
            self.settle()
        elif verb == "signal":
            self.send(BpmnEvent(SignalEventDefinition(name), payload=step["data"]))
        elif verb == "message":
            self.send(BpmnEvent(MessageEventDefinition(name), payload=step["data"]))
        elif verb == "advance":
            self.advance(step["seconds"])


def main() -> None:
    order = json.load(sys.stdin)
    timer.datetime = Clock
    answer: Data = {"steps": [], "ended": "running", "data": {}, "problem": "", "refused": False}
    application = None
    try:
        application = Application(order)
        application.parser.get_subprocess_specs(order["main"])
    except Exception as error:
        answer |= {"refused": True, "problem": said(error)}
        print(json.dumps(answer))
        return
    for step in order["steps"]:
        application.entered = []
        try:
            application.step(step, order)
        except LookupError as error:
            answer["problem"] = said(error)
        except Exception as error:
            application.look()
            answer |= {"ended": "failed", "problem": said(error)}
            if isinstance(error, ValidationException):
                answer["refused"] = True
        answer["steps"].append(application.entered)
        if answer["problem"]:
            break
    if not answer["problem"] and all(w.is_completed() for w in application.instances):
        answer["ended"] = "completed"
    if application.instances:
        first = application.instances[0]
        answer["data"] = {**first.data, **(first.last_task.data if first.last_task else {})}
    print(json.dumps(answer, default=str))


def said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]


if __name__ == "__main__":
    main()
