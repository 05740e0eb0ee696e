"""The handlers of BPMN elements: one module for each family of elements.

`HANDLERS` says which kind of element has which hooks (`m2pem.engine.execution.ElementHandler`).
"""

from dataclasses import replace

from m2pem.engine.elements import activities, events, gateways, subprocesses, tasks
from m2pem.engine.elements.behaviors import time_is_up
from m2pem.engine.execution import ElementHandler, Execution, Hook
from m2pem.mission import elements as e
from m2pem.mission.elements import FlowNode


def _activity(execute: Hook) -> ElementHandler:
    return ElementHandler(
        enter=activities.enter_activity,
        activate=activities.begin_activity,
        execute=execute,
        trigger=activities.complete,
        complete=activities.complete,
    )


HANDLERS: dict[type[FlowNode], ElementHandler] = {
    # Activities
    e.Task: _activity(tasks.pass_through),
    e.ManualTask: _activity(tasks.pass_through),
    e.UserTask: replace(
        _activity(tasks.user_task), trigger=tasks.prompt_timed_out, answer=tasks.answer_user_task
    ),
    e.ScriptTask: replace(_activity(tasks.script_task), trigger=time_is_up),
    e.ServiceTask: replace(_activity(tasks.service_task), trigger=time_is_up),
    e.BusinessRuleTask: replace(_activity(tasks.service_task), trigger=time_is_up),
    e.SendTask: replace(_activity(tasks.send_task), trigger=time_is_up),
    e.ReceiveTask: _activity(tasks.receive_task),
    e.SubProcess: _activity(subprocesses.subprocess),
    e.Transaction: _activity(subprocesses.subprocess),
    e.AdHocSubProcess: replace(_activity(subprocesses.ad_hoc), answer=subprocesses.answer_ad_hoc),
    e.CallActivity: _activity(subprocesses.call_activity),
    # Gateways
    e.ExclusiveGateway: ElementHandler(activate=gateways.exclusive),
    e.ParallelGateway: ElementHandler(activate=gateways.parallel),
    e.InclusiveGateway: ElementHandler(activate=gateways.inclusive),
    e.ComplexGateway: ElementHandler(activate=gateways.complex_gateway),
    e.EventBasedGateway: ElementHandler(activate=gateways.event_based, enter=gateways.event_based),
    # Events
    e.StartEvent: ElementHandler(
        activate=events.start,
        enter=events.start,
        trigger=events.complete,
        complete=events.complete,
    ),
    e.IntermediateCatchEvent: ElementHandler(
        activate=events.catch,
        enter=events.catch,
        trigger=events.complete,
        complete=events.complete,
    ),
    e.IntermediateThrowEvent: ElementHandler(activate=events.throw, complete=events.complete),
    e.BoundaryEvent: ElementHandler(activate=events.leave_caught, complete=events.complete),
    e.EndEvent: ElementHandler(activate=events.end, complete=Execution.consume),
}
