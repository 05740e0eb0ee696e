"""Which names of the data store a mission reads or writes anywhere."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from m2pem.fleet.behaviors import SHARED
from m2pem.mission import elements as e
from m2pem.mission.behavior import Assignment, Parameter
from m2pem.mission.expression import Expression
from m2pem.mission.loops import MultiInstance, StandardLoop
from m2pem.mission.mission import Mission


def data_names(
    mission: Mission, service_writes: Mapping[str, Sequence[str]] | None = None
) -> frozenset[str]:
    """Names that are written, or that conditions, parameters and mappings read.

    `service_writes`: what services write, by class.
    """
    found: set[str] = {*mission.associated, *mission.data_stores}
    for process in mission.processes:
        found.update(each.key for each in process.data)
    for flow in mission.flows:
        if flow.condition is not None:
            found |= flow.condition.names
    for node in mission.nodes:
        found.update(written_by(node, service_writes or {}))
        for expression in read_by(node):
            found |= expression.names
    return frozenset(name for name in found if name)


def written_by(node: e.FlowNode, services: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Names that a node writes, or declares; `services`: what services write, by class."""
    if isinstance(node, e.SubProcess):
        yield from (each.key for each in node.data)
    if isinstance(node, e.Activity | e.Event):
        yield from (each.target for each in node.data_flow.outputs)
    if isinstance(node, e.CallActivity):
        yield from (each.target for each in node.mappings.outputs)
    elif isinstance(node, e.UserTask) and node.prompt is not None:
        yield node.prompt.store
    elif isinstance(node, e.ScriptTask) and node.script is not None:
        yield from (s.key for s in node.script.statements if isinstance(s, Assignment))
    elif isinstance(node, e.ServiceTask) and node.call is not None:
        yield from services.get(node.call.service, ())
    behavior = getattr(node, "behavior", None)
    if behavior is not None and (behavior.name, behavior.type) in SHARED:
        yield from SHARED[behavior.name, behavior.type].writes
    if isinstance(node, e.Activity) and isinstance(node.loop, MultiInstance):
        yield node.loop.output_collection


def read_by(node: e.FlowNode) -> Iterator[Expression]:
    """The expressions that a node reads."""
    parameters: Iterable[Parameter] = ()
    behavior = getattr(node, "behavior", None)
    if behavior is not None:
        parameters = behavior.parameters
    elif isinstance(node, e.ServiceTask) and node.call is not None:
        parameters = node.call.properties
    yield from (each.value for each in parameters if isinstance(each.value, Expression))
    if isinstance(node, e.ScriptTask) and node.script is not None:
        yield from (s.expression for s in node.script.statements if isinstance(s, Assignment))
    if isinstance(node, e.CallActivity):
        yield from (each.source for each in node.mappings.inputs)
    loop = node.loop if isinstance(node, e.Activity) else None
    conditions: tuple[Expression | None, ...] = ()
    if isinstance(loop, StandardLoop):
        conditions = (loop.condition,)
    elif isinstance(loop, MultiInstance):
        conditions = (loop.cardinality, loop.collection, loop.completion)
    yield from (each for each in conditions if each is not None)
