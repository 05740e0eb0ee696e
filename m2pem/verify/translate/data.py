"""Data in the net: a variable for each followed name of each process instance."""

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

from m2pem.errors import ExpressionError
from m2pem.fleet.behaviors import SHARED
from m2pem.mission import elements as e
from m2pem.mission.behavior import Assignment, Behavior
from m2pem.mission.events import ConditionalEventDefinition, caught_data
from m2pem.mission.expression import Dialect, Expression, parse
from m2pem.mission.expression.expression import literal
from m2pem.mission.expression.tree import ListOf, Literal
from m2pem.mission.loops import INSTANCE_COUNTS, LOOP_COUNTER, MultiInstance, StandardLoop
from m2pem.mission.mission import Mission
from m2pem.mission.values import Value
from m2pem.verify.net.petri_net import Variable
from m2pem.verify.net.size_limit import SizeLimit
from m2pem.verify.translate.domains import MOST_COMBINATIONS, Domains, Write, tells_apart
from m2pem.verify.translate.net_builder import Effect, ScopeDraft
from m2pem.verify.translate.options import Options
from m2pem.verify.translate.payloads import Payloads

ERROR = "error"
"""In place of a truth: the condition cannot be evaluated."""

Truth = bool | str
Outcome = TypeVar("Outcome", bound=Hashable)


class Data:
    """The followed names of a mission, and what reads and writes them."""

    def __init__(
        self,
        mission: Mission,
        options: Options,
        size_limit: SizeLimit | None = None,
        stored: Mapping[e.FlowNode, Mapping[str, list[Value] | None]] | None = None,
    ) -> None:
        """`stored`: by task and name, the resources that it may store there."""
        self._mission = mission
        self._stored = stored or {}
        self._size_limit = size_limit or SizeLimit()
        self._options = options
        self._hidden: dict[e.FlowNode, frozenset[str]] = {}
        self._initial = dict(_flat(options.data))
        self._payloads = Payloads(mission, open_world=options.open_world)
        self.domains = Domains(
            self._conditions(), self._writes(), self._initial, _not_followed(mission)
        )
        self.variables: list[Variable] = []
        self._known: dict[tuple[str, tuple[str, ...]], int] = {}

    # --- names ----------------------------------------------------------------------------------

    def hidden(self, node: e.FlowNode) -> frozenset[str]:
        """Names at a node that are not the process's: data of activities and of their instances."""
        found = self._hidden.get(node)
        if found is None:
            names: set[str] = set()
            each: object = node
            while isinstance(each, e.FlowNode):
                if isinstance(each, e.Activity):
                    names |= each.own_data
                    if each.loop is not None:
                        names |= {LOOP_COUNTER, *INSTANCE_COUNTS}
                        if isinstance(each.loop, MultiInstance) and each.loop.item:
                            names.add(each.loop.item)
                each = each.container
                if isinstance(each, e.SubProcess):
                    names |= {data.key for data in each.data}
            found = self._hidden[node] = frozenset(names)
        return found

    def _is_hidden(self, name: str, hidden: frozenset[str]) -> bool:
        return name in hidden or name.partition(".")[0] in hidden

    def variable(self, key: str, frame: tuple[str, ...]) -> int:
        """The variable of a followed name, as a process instance sees it."""
        if key in self._mission.data_stores:
            frame = ()
        known = self._known.get((key, frame))
        if known is None:
            known = self._known[key, frame] = len(self.variables)
            domain = self.domains.of[key]
            name = ".".join((*frame[1:], key))
            initial = domain.find(self._initial.get(key)) if len(frame) <= 1 else None
            if initial is None:
                initial = domain.add(None)
            self.variables.append(
                Variable(known, name, tuple(domain.values), tuple(domain.exact), initial, key)
            )
        return known

    def initial(self, process: e.Process, frame: tuple[str, ...]) -> dict[int, int]:
        """The values of the variables that a process reads when an instance of it begins."""
        variables = [
            self.variable(key, frame)
            for key in self.domains.of
            if key not in self._mission.data_stores and self.is_read_in(key, process)
        ]
        return {each: self.variables[each].initial for each in variables}

    # --- reading --------------------------------------------------------------------------------

    def cases(
        self,
        conditions: Sequence[Expression],
        scope: ScopeDraft,
        node: e.FlowNode,
        choose: Callable[[Sequence[Truth]], Outcome],
        own: frozenset[str] = frozenset(),
    ) -> list[tuple[dict[int, frozenset[int]], Outcome]]:
        """Return (guard, outcome) pairs: what `choose` makes of the truths of some conditions.

        An unknown condition counts once as true and once as false.
        """
        hidden = self.hidden(node) | own
        names = sorted({n for c in conditions for n in c.names if self._follows(n, hidden)})
        if not self._small(names):
            names = []
        chosen: dict[Outcome, list[tuple[int, ...]]] = {}
        ranges = [range(len(self.domains.of[name].values)) for name in names]
        for combination in itertools.product(*ranges):
            options = [self._truths(c, names, combination) for c in conditions]
            for truths in itertools.product(*options):
                self._size_limit.count_case(node.id)
                where = chosen.setdefault(choose(truths), [])
                if not where or where[-1] != combination:
                    where.append(combination)
        variables = [self.variable(name, scope.frame) for name in names]
        return [
            (dict(zip(variables, box, strict=True)), outcome)
            for outcome, combinations in chosen.items()
            for box in boxes(combinations, [len(each) for each in ranges])
        ]

    def _follows(self, name: str, hidden: frozenset[str]) -> bool:
        return name in self.domains.of and not self._is_hidden(name, hidden)

    def _small(self, names: Iterable[str]) -> bool:
        size = 1
        for name in names:
            size *= len(self.domains.of[name].values)
        return size <= MOST_COMBINATIONS

    def _truths(
        self,
        condition: Expression,
        names: Sequence[str],
        combination: Sequence[int],
    ) -> tuple[Truth, ...]:
        numbers = dict(zip(names, combination, strict=True))
        if any(name not in numbers for name in condition.names):
            return (True, False)
        domains = self.domains.of
        exact = all(domains[name].exact[numbers[name]] for name in condition.names)
        if not exact and not tells_apart(condition.tree):
            return (True, False)
        try:
            return (condition.holds(lambda n: domains[n].values[numbers[n]]),)
        except ExpressionError:
            return (ERROR,)

    def is_followed(self, conditions: Iterable[Expression], node: e.FlowNode) -> bool:
        """Whether all names that some conditions read are followed, value by value."""
        hidden = self.hidden(node)
        names = {name for condition in conditions for name in condition.names}
        return all(self._follows(name, hidden) for name in names) and self._small(names)

    def is_blurred(self, key: str) -> bool:
        """Whether a name is followed, but with values that represent many."""
        return key in self.domains.of and not self.domains.of[key].closed

    def values_of(
        self, key: str, scope: ScopeDraft, node: e.FlowNode
    ) -> tuple[int, Sequence[tuple[Value, bool]]] | None:
        """Return the variable of a name as a node sees it, and its values, each with whether it
        represents only itself; None: the name is not followed.
        """
        if not self._follows(key, self.hidden(node)):
            return None
        domain = self.domains.of[key]
        variable = self.variable(key, scope.frame)
        return variable, list(zip(domain.values, domain.exact, strict=True))

    # --- writing --------------------------------------------------------------------------------

    def write(
        self,
        effects: Iterable[Effect],
        key: str,
        source: Expression | None,
        scope: ScopeDraft,
        node: e.FlowNode,
        into: tuple[str, ...] | None = None,
        unable: list[Effect] | None = None,
    ) -> list[Effect]:
        """Return the effects with a write to a name added; several effects if the value is unknown.

        `into`: the process instance that has the name, when it is not the scope's own. `unable`
        gets the effects after which the value cannot be evaluated.
        """
        hidden = self.hidden(node) if into is None else frozenset()
        if not self._follows(key, hidden):
            return list(effects)
        target = self.variable(key, scope.frame if into is None else into)
        found: list[Effect] = []
        for effect in effects:
            for guard, value in self._values(effect, key, source, scope, node):
                self._size_limit.count_case(node.id)
                assign = {} if value is None else {target: value}
                both = effect.then(Effect(guard=guard, assign=assign))
                if both is not None and value is not None:
                    found.append(both)
                elif both is not None and unable is not None:
                    unable.append(both)
        return found

    def receive(self, effects: list[Effect], scope: ScopeDraft, node: e.FlowNode) -> list[Effect]:
        """Return the effects with writes of what a signal or message brings to its catcher."""
        for each in self._payloads.received_values(node):
            if self._follows(each.key, self.hidden(node)):
                found = list(effects) if each.perhaps else []
                for source in each.sources:
                    found += self.write(effects, each.key, source, scope, node)
                effects = found
        return effects

    def receives(self, node: e.FlowNode) -> bool:
        """Whether a signal or message may write a followed name at a node."""
        hidden = self.hidden(node)
        return any(self._follows(each.key, hidden) for each in self._payloads.received_values(node))

    def _values(
        self,
        effect: Effect,
        key: str,
        source: Expression | None,
        scope: ScopeDraft,
        node: e.FlowNode | None,
    ) -> Iterator[tuple[dict[int, frozenset[int]], int | None]]:
        """Return (value's number, guard) pairs. None in place of a number: it cannot be
        evaluated.
        """
        domain = self.domains.of[key]
        anything = range(len(domain.values))
        hidden = self.hidden(node) if node is not None else frozenset()
        names = sorted(source.names) if source is not None else []
        if source is None or not all(self._follows(n, hidden) for n in names):
            yield from (({}, number) for number in anything)
            return
        if not self._small(names):
            yield from (({}, number) for number in anything)
            return
        variables = [self.variable(name, scope.frame) for name in names]
        choices = []
        for variable in variables:
            allowed: Iterable[int] = range(len(self.variables[variable].values))
            if variable in effect.assign:
                allowed = (effect.assign[variable],)
            elif variable in effect.guard:
                allowed = sorted(effect.guard[variable])
            choices.append(allowed)
        for combination in itertools.product(*choices):
            guard = {
                variable: frozenset({number})
                for variable, number in zip(variables, combination, strict=True)
                if variable not in effect.assign
            }
            of = {name: self.domains.of[name] for name in names}
            numbers = dict(zip(names, combination, strict=True))
            values: Iterable[int | None] = anything
            if all(of[name].exact[numbers[name]] for name in names):
                try:
                    values = domain.like(source.evaluate(lambda n: of[n].values[numbers[n]]))  # noqa: B023
                except ExpressionError:
                    # Where values are supposed that may never be written, so is this one.
                    values = (None,) if all(of[name].closed for name in names) else anything
            yield from ((guard, each) for each in values)

    def write_out(
        self,
        effects: Iterable[Effect],
        key: str,
        source: Expression,
        inside: ScopeDraft,
        outer: ScopeDraft,
        node: e.FlowNode,
    ) -> list[Effect]:
        """Write an output of a called process: its own names are read, the caller's are written."""
        if not self._follows(key, self.hidden(node)):
            return list(effects)
        target = self.variable(key, outer.frame)
        found: list[Effect] = []
        for effect in effects:
            for guard, value in self._values(effect, key, source, inside, None):
                if value is None:
                    continue
                self._size_limit.count_case(node.id)
                both = effect.then(Effect(guard=guard, assign={target: value}))
                if both is not None:
                    found.append(both)
        return found

    def is_read_in(self, key: str, process: e.Process) -> bool:
        """Whether a followed name is a process's own, rather than only its caller's."""
        del process
        return key in self.domains.of

    # --- the mission's own ----------------------------------------------------------------------

    def follow(self, frame: tuple[str, ...]) -> None:
        """Create the variables that the options' conditions read, of one process instance."""
        for condition in self._options.conditions:
            for name in sorted(condition.names):
                if self._follows(name, frozenset()):
                    self.variable(name, frame)

    def _conditions(self) -> Iterator[tuple[Expression, frozenset[str]]]:
        yield from ((condition, frozenset()) for condition in self._options.conditions)
        for flow in self._mission.flows:
            if flow.condition is not None:
                yield flow.condition, self.hidden(flow.source)
        for node in self._mission.nodes:
            hidden = self.hidden(node)
            found: list[Expression | None] = []
            if isinstance(node, e.Event):
                found += [
                    d.condition
                    for d in node.definitions
                    if isinstance(d, ConditionalEventDefinition)
                ]
            if isinstance(node, e.Activity) and isinstance(node.loop, StandardLoop):
                found.append(node.loop.condition)
            if isinstance(node, e.AdHocSubProcess):
                found.append(node.completion)
            behavior: Behavior | None = getattr(node, "behavior", None)
            for role in behavior.roles if behavior is not None else ():
                if role.need is not None and role.need.same:
                    found.append(parse(role.need.same))
            for condition in found:
                if condition is not None:
                    yield condition, hidden

    def _writes(self) -> Iterator[Write]:
        for node in self._mission.nodes:
            hidden = self.hidden(node)
            for write in self._writes_of(node, hidden):
                if not self._is_hidden(write.key, hidden):
                    yield write

    def _writes_of(self, node: e.FlowNode, hidden: frozenset[str]) -> Iterator[Write]:
        if isinstance(node, e.Activity):
            for mapping in node.data_flow.outputs:
                yield Write(mapping.target, None)
        for received_values in self._payloads.received_values(node):
            for source in received_values.sources:
                yield Write(received_values.key, source)
        loop = node.loop if isinstance(node, e.Activity) else None
        if isinstance(loop, MultiInstance) and loop.output_collection:
            yield Write(loop.output_collection, None)
        for key in self.written_anyhow(node):
            yield Write(key, None)
        for key, values in self._stored.get(node, {}).items():
            yield from (Write(key, constant(value)) for value in values or ())
            if values is None:
                yield Write(key, None)
        match node:
            case e.ScriptTask(script=script) if script is not None:
                for statement in script.statements:
                    if isinstance(statement, Assignment):
                        yield Write(statement.key, statement.expression, hidden)
            case e.UserTask(prompt=prompt) if prompt is not None:
                for decision in prompt.decisions:
                    yield Write(prompt.store, literal(decision.value))
            case e.CallActivity(mappings=mappings):
                for mapping in (*mappings.inputs, *mappings.outputs):
                    yield Write(mapping.target, mapping.source, hidden)
            case _:
                pass

    def written_anyhow(self, node: e.FlowNode) -> tuple[str, ...]:
        """Names to which an element may write any value."""
        behavior: Behavior | None = getattr(node, "behavior", None)
        if behavior is not None:
            spec = SHARED.get((behavior.name, behavior.type))
            return spec.writes if spec is not None else ()
        if isinstance(node, e.ServiceTask) and node.call is not None:
            return tuple(self._options.service_writes.get(node.call.service, ()))
        return ()


def constant(value: Value) -> Expression:
    """Return the expression that is always the name of a resource, or a list of names."""
    if isinstance(value, list):
        items = ListOf(tuple(Literal(str(each)) for each in value))
        return Expression(repr(value), Dialect.BARE, items)
    return literal(str(value))


def _flat(data: object, prefix: str = "") -> Iterator[tuple[str, Value]]:
    assert hasattr(data, "items")
    for key, value in data.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def boxes(
    combinations: Sequence[tuple[int, ...]], sizes: Sequence[int]
) -> Iterator[tuple[frozenset[int], ...]]:
    """Combinations as few products of sets: those that differ in one position only are merged."""
    current: list[tuple[frozenset[int], ...]] = [
        tuple(frozenset({number}) for number in each) for each in dict.fromkeys(combinations)
    ]
    for place in range(len(sizes) - 1, -1, -1):
        grouped: dict[tuple[frozenset[int], ...], set[int]] = {}
        for each in current:
            rest = each[:place] + each[place + 1 :]
            grouped.setdefault(rest, set()).update(each[place])
        current = [
            (*rest[:place], frozenset(numbers), *rest[place:]) for rest, numbers in grouped.items()
        ]
    yield from current


def _not_followed(mission: Mission) -> frozenset[str]:
    """Names that events write with what they catch, or by mappings of other engines."""
    found: set[str] = set()
    for node in mission.nodes:
        if isinstance(node, e.Event):
            found |= set(caught_data(node.definitions, ""))
            if node.data_flow.ordered:
                found |= {mapping.target for mapping in node.data_flow.outputs}
    return frozenset(found)
