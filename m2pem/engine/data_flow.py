"""Data associations: data inputs and outputs of activities and events (BPMN 2.0.2, 10.4.2)."""

from m2pem.engine.data import flatten, reader, store_for
from m2pem.engine.execution import Execution
from m2pem.engine.state import Token, TokenOrScope
from m2pem.engine.throwing import throw_error
from m2pem.errors import ExpressionError
from m2pem.mission.behavior import Mapping
from m2pem.mission.elements import Activity, Event, ReceiveTask
from m2pem.mission.loops import LOOP_COUNTER, MultiInstance
from m2pem.mission.values import ReadValue, Value


def evaluate(
    x: Execution,
    token: Token,
    mappings: tuple[Mapping, ...],
    read: ReadValue,
    *,
    ordered: bool = False,
) -> list[tuple[Mapping, Value]] | None:
    """Evaluate mappings; None: error EXPRESSION was thrown. `ordered`: each reads what those before
    it have set."""
    values: list[tuple[Mapping, Value]] = []
    done: dict[str, Value] = {}
    if ordered:
        around = read

        def read(name: str) -> Value:
            return done[name] if name in done else around(name)

    for mapping in mappings:
        try:
            value = mapping.source.evaluate(read)
            values.append((mapping, value))
            if ordered:
                done.update({mapping.target: value, **dict(flatten(mapping.target, value))})
        except ExpressionError as error:
            throw_error(x, token, "EXPRESSION", f"mapping to {mapping.target}: {error}")
            return None
    return values


def write_values(
    x: Execution, token: Token, context: TokenOrScope, values: list[tuple[Mapping, Value]]
) -> None:
    """Write the values of mappings, with names as seen from a token or scope."""
    for mapping, value in values:
        for key, item in flatten(mapping.target, value):
            x.write_into(store_for(context, key), token, key, item)


def fill_data_inputs(x: Execution, token: Token) -> bool:
    """Fill the data inputs of the activity, or instance, that a token has entered.

    False: error EXPRESSION was thrown.
    """
    node = token.node
    assert isinstance(node, Activity)
    flow = node.data_flow
    values = evaluate(x, token, flow.inputs, _around(token), ordered=flow.ordered)
    if values is None:
        return False
    for mapping, value in values:
        if value is not None:  # a missing value reads as null anyway
            x.write_into(token, token, mapping.target, value)
    return True


def _around(token: Token) -> ReadValue:
    """Return a function that reads names from outside an activity, but an instance's own item."""
    outside = reader(token.scope)
    if token.instance is None:
        return outside
    inside = reader(token)
    item = token.own or {}  # it has nothing else before its inputs

    def read(name: str) -> Value:
        own_name = name == LOOP_COUNTER or name in item or name.partition(".")[0] in item
        return inside(name) if own_name else outside(name)

    return read


def pass_data_outputs(x: Execution, token: Token) -> bool:
    """Write the data outputs of a completed activity. False: error EXPRESSION was thrown."""
    node = token.node
    assert isinstance(node, Activity)
    flow = node.data_flow
    values = evaluate(x, token, flow.outputs, reader(token), ordered=flow.ordered)
    if values is None:
        return False
    gives = node.loop.output_item if isinstance(node.loop, MultiInstance) else ""
    for mapping, value in values:
        context = token if mapping.target == gives else token.scope
        write_values(x, token, context, [(mapping, value)])
    return True


# --- data of messages and signals ---------------------------------------------------------------


def payload(x: Execution, token: Token) -> dict[str, Value] | None:
    """Return the data that an event or task sends: its data inputs.

    None: error EXPRESSION was thrown.
    """
    node = token.node
    assert isinstance(node, Activity | Event)
    if isinstance(node, Activity):
        own = token.own or {}
        return {m.target: own[m.target] for m in node.data_flow.inputs if m.target in own}
    flow = node.data_flow
    values = evaluate(x, token, flow.inputs, reader(token), ordered=flow.ordered)
    return None if values is None else {mapping.target: value for mapping, value in values}


def receive_payload(x: Execution, token: Token, data: dict[str, Value]) -> bool:
    """Write received data by the data outputs of the catcher, else under its own names.

    A single value goes to a single data output whatever their names. False: error EXPRESSION was
    thrown.
    """
    node = token.node
    if isinstance(node, Event) and node.data_flow.outputs:
        return _out_of_event(x, token, node, data)
    if isinstance(node, ReceiveTask) and len(data) == 1 and len(node.data_flow.outputs) == 1:
        names = list(node.data_flow.outputs[0].source.names)
        if len(names) == 1:
            data = {names[0]: next(iter(data.values()))}
    x.write_all(token, data)
    return True


def pass_event_outputs(x: Execution, token: Token) -> bool:
    """Pass the outputs of an event that receives nothing, which other engines have; they read its
    inputs. False: error EXPRESSION was thrown."""
    node = token.node
    assert isinstance(node, Event)
    if not (node.data_flow.ordered and node.data_flow.outputs):
        return True
    data = payload(x, token)
    return data is not None and _out_of_event(x, token, node, data)


def _out_of_event(x: Execution, token: Token, node: Event, data: dict[str, Value]) -> bool:
    around = reader(token)
    only = next(iter(data.values())) if len(data) == 1 else None
    flow = node.data_flow
    alone = len(flow.outputs) == 1 and not flow.ordered

    def read(name: str) -> Value:
        if name in data:
            return data[name]
        return only if alone and only is not None else around(name)

    values = evaluate(x, token, flow.outputs, read, ordered=flow.ordered)
    if values is None:
        return False
    write_values(x, token, token, values)
    return True
