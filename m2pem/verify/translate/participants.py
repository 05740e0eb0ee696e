"""The participants of a collaboration: which processes are begun together with the main one.

A run of the executive begins with one process; another one begins when it is called, or by its
trigger (BPMN 2.0.2, 13.5.1). BPMN does not say who begins a pool whose start event has no trigger
(10.5.2, 13.2). Other checkers begin all pools together: `Options.all_pools`.
"""

from m2pem.mission import elements as e
from m2pem.mission.events import (
    MessageEventDefinition,
    SignalEventDefinition,
    TimerEventDefinition,
)
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import Action, Role, Step
from m2pem.verify.translate.context import TranslationContext
from m2pem.verify.translate.net_builder import Effect, ScopeDraft, entry_place
from m2pem.verify.translate.scopes import begin
from m2pem.verify.translate.subprocesses import build


def begun_by_nothing(mission: Mission, root: e.Process) -> list[e.Process]:
    """The processes of the file with an entry that has no trigger, which nothing begins where a run
    begins with `root`: no process calls them.
    """
    called = {n.called for n in mission.nodes if isinstance(n, e.CallActivity)}
    return [
        each
        for each in mission.processes
        if each is not root
        and each not in called
        and not (each.file or each.global_task)
        and untriggered(each)
    ]


def participants(mission: Mission, root: e.Process) -> list[e.Process]:
    """Those of them that are a pool of a collaboration."""
    pools = {each.process_id for each in mission.participants}
    return [each for each in begun_by_nothing(mission, root) if each.id in pools]


def triggers_of(entry: e.FlowNode) -> list[e.FlowNode]:
    """The elements whose triggers begin a process at an entry; none: the entry has no trigger."""
    if isinstance(entry, e.EventBasedGateway):
        return [flow.target for flow in entry.outgoing]
    if isinstance(entry, e.StartEvent):
        return [entry] if entry.definitions else []
    return [entry] if isinstance(entry, e.ReceiveTask) and entry.instantiate else []


def untriggered(process: e.Process) -> list[e.FlowNode]:
    """The entries of a process that get a token when it begins."""
    return [each for each in process.entries if not triggers_of(each)]


_TRIGGERS = (SignalEventDefinition, MessageEventDefinition, TimerEventDefinition)
_EVENTS = (e.StartEvent, e.EndEvent, e.IntermediateCatchEvent, e.IntermediateThrowEvent)
_TASKS = (e.Task, e.SendTask, e.ReceiveTask, e.UserTask)


def instance_is_token(process: e.Process) -> bool:
    """Whether an instance is one token that nothing else in the instance meets, interrupts or
    reads: it begins by a signal or message, and passes events, tasks and exclusive gateways."""
    starts = [each for each in process.entries if isinstance(each, e.StartEvent)]
    return (
        not process.event_subprocesses
        and all(map(_is_alone, process.nodes))
        and all(flow.condition is None for flow in process.flows)
        and len(starts) == len(process.entries)
        and all(
            isinstance(d, _TRIGGERS[:2]) for each in starts for d in each.definitions or (None,)
        )
    )


def _is_alone(node: e.FlowNode) -> bool:
    if isinstance(node, e.ExclusiveGateway):
        return True
    if isinstance(node, e.Event):
        known = all(isinstance(each, _TRIGGERS) for each in node.definitions)
        return type(node) in _EVENTS and known and len(node.definitions) < 2 > len(node.outgoing)
    if not isinstance(node, e.Activity) or type(node) not in _TASKS or len(node.outgoing) > 1:
        return False
    more = node.loop or node.boundary or node.for_compensation or getattr(node, "behavior", None)
    begins = isinstance(node, e.ReceiveTask) and node.instantiate
    return not more and not begins and node.start_quantity == node.completion_quantity == 1


def begin_together(context: TranslationContext, process: e.Process) -> tuple[int, ...]:
    """Translate the instance of a process that begins with the run; return the places that have a
    token then."""
    step = f"{process.id}#0"
    scope = context.net.scope(process, context.everything, step=step, frame=(process.id, step))
    build(context, process, scope)
    entries = [entry_place(context.net, each, scope) for each in untriggered(process)]
    return (alive(context, process, scope), *entries, *without_entries(context, process, scope))


def alive(context: TranslationContext, process: e.Process, scope: ScopeDraft) -> int:
    """Return the place of a token while an instance of a process is active; it ends when it is
    empty, and its data with it."""
    place = context.net.place(process, scope, Role.CONTROL, ":alive")
    notes = context.notes_scopes.get(scope.index, scope)
    over = Effect(
        steps=(Step(process.id, Action.COMPLETED),),
        consume=(place,),
        assign=context.data.initial(process, scope.frame),
        reset_scopes=frozenset({scope.index, notes.index}),
        empty_scopes=frozenset({scope.index}),
    )
    context.net.transition(over)
    return place


def without_entries(
    context: TranslationContext, process: e.Process, scope: ScopeDraft
) -> list[int]:
    """The places with a token when an instance begins, without those of its entries."""
    entries = {entry_place(context.net, entry, scope) for entry in process.entries}
    return [n for n in begin(context, process, scope).produce if n not in entries]
