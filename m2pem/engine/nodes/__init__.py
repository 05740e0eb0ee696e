"""One handler for each kind of BPMN element: what executing a token on it does.

`EXECUTE` maps a kind of node to its handler; `m2pem.engine.waiting.WHEN_TRIGGERED` maps kinds that
wait at their own node to what follows.
"""

from collections.abc import Callable

from m2pem.engine.execution import Execution
from m2pem.engine.nodes import activities, containers, events, gateways
from m2pem.engine.state import Token
from m2pem.engine.waiting import WHEN_TRIGGERED
from m2pem.model import elements as e
from m2pem.model.elements import FlowNode

EXECUTE: dict[type[FlowNode], Callable[[Execution, Token], None]] = {
    e.Task: activities.pass_through,
    e.ManualTask: activities.pass_through,
    e.UserTask: activities.user_task,
    e.ScriptTask: activities.script_task,
    e.ServiceTask: activities.service_task,
    e.SendTask: activities.send_task,
    e.ReceiveTask: activities.receive_task,
    e.SubProcess: containers.subprocess,
    e.CallActivity: containers.call_activity,
    e.ExclusiveGateway: gateways.exclusive,
    e.ParallelGateway: gateways.parallel,
    e.InclusiveGateway: gateways.inclusive,
    e.StartEvent: events.start,
    e.EndEvent: events.end,
    e.IntermediateCatchEvent: events.catch,
    e.IntermediateThrowEvent: events.throw,
    e.BoundaryEvent: events.boundary,
}

WHEN_TRIGGERED.update(
    {
        e.UserTask: activities.prompt_timed_out,
        e.ScriptTask: activities.complete,
        e.ServiceTask: activities.complete,
        e.SendTask: activities.complete,
        e.ReceiveTask: activities.complete,
        e.StartEvent: events.complete,
        e.IntermediateCatchEvent: events.complete,
    }
)
