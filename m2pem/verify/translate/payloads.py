"""Payloads: what signals and messages bring to their catchers."""

from collections.abc import Iterator
from dataclasses import dataclass

from m2pem.errors import ExpressionError
from m2pem.mission import elements as e
from m2pem.mission.behavior import Mapping
from m2pem.mission.expression import Expression
from m2pem.mission.expression.tree import Name
from m2pem.mission.mission import Mission

_SIMPLE = (bool, int, float, str)


@dataclass(frozen=True, slots=True)
class ReceivedValue:
    """What a name may get: the value of a constant, or any (None). `perhaps`: or it keeps its
    value.
    """

    key: str
    sources: tuple[Expression | None, ...]
    perhaps: bool


class Payloads:
    """The payloads of all senders of a mission."""

    def __init__(self, mission: Mission, *, open_world: bool) -> None:
        self._mission = mission
        self._open_world = open_world
        self._sent: dict[str, list[dict[str, Expression | None]]] = {}
        for node in mission.nodes:
            for root in e.thrown_by(node):
                assert isinstance(node, e.Activity | e.Event)
                inputs = {m.target: _constant(m) for m in node.data_flow.inputs}
                self._sent.setdefault(root.id, []).append(inputs)

    def received_values(self, node: e.FlowNode) -> list[ReceivedValue]:
        """Return the values that a catch event or receive task may get by any of its triggers."""
        found: dict[str, ReceivedValue] = {}
        roots = e.caught_by(node)
        for root in roots:
            for each in self._by(node, root.id):
                known = found.get(each.key)
                sources = (*(known.sources if known else ()), *each.sources)
                anything = any(source is None for source in sources)
                found[each.key] = ReceivedValue(
                    each.key, (None,) if anything else sources, each.perhaps
                )
        definitions = node.definitions if isinstance(node, e.Event) else ()
        if len(roots) > 1 or len(definitions) > len(roots):
            return [ReceivedValue(each.key, each.sources, perhaps=True) for each in found.values()]
        return list(found.values())

    def _by(self, node: e.FlowNode, ref: str) -> Iterator[ReceivedValue]:
        sent, outside = self._sent.get(ref, []), self._comes_from_outside(ref)
        if isinstance(node, e.Event) and node.data_flow.outputs:
            for mapping in node.data_flow.outputs:
                alone = len(node.data_flow.outputs) == 1 and isinstance(mapping.source.tree, Name)
                single = alone and not outside and all(len(each) == 1 for each in sent)
                sources = [next(iter(each.values())) if single else None for each in sent]
                if sources or outside:
                    yield ReceivedValue(mapping.target, tuple(sources or [None]), perhaps=False)
            return
        if isinstance(node, e.ReceiveTask) and node.data_flow.outputs:
            return  # its outputs say where it goes when it has completed
        for key in dict.fromkeys(key for each in sent for key in each):
            values = [each[key] for each in sent if key in each]
            perhaps = outside or len(values) < len(sent)
            yield ReceivedValue(key, (*values, None) if outside else tuple(values), perhaps)

    def _comes_from_outside(self, ref: str) -> bool:
        if self._open_world:
            return True
        signal = self._mission.signals.get(ref)
        if signal is not None:
            return bool(signal.from_operator or signal.returned)
        message = self._mission.messages.get(ref)
        black_box_messages = any(
            f.source_id not in self._mission.elements for f in self._mission.message_flows
        )
        return message is None or bool(message.from_operator) or black_box_messages


def _constant(mapping: Mapping) -> Expression | None:
    if not mapping.source.constant:
        return None
    try:
        value = mapping.source.evaluate(lambda _: None)
    except ExpressionError:
        return None
    return mapping.source if isinstance(value, _SIMPLE) else None
