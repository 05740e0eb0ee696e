"""The reference interpreter: all that a model may do between one input and the next.

Inputs are answers to user tasks and signals from outside. After an input everything moves until
nothing can move any more; the marking is then at rest. What may happen in between depends on the
order of the steps, so a reaction is a set: it has every marking at rest that some order leads to.
"""

from dataclasses import dataclass

from tests.reference.catching import TooLargeError, broadcast, catchers
from tests.reference.diagram import Level, Many, birth, levels
from tests.reference.marking import Key, Marking, Scope
from tests.reference.rules import enter_what_waits, finish, steps, take


@dataclass(frozen=True, slots=True)
class Input:
    """An answer to one open user task `name` (`value` None: that it is done), or a signal."""

    kind: str
    name: str
    value: str | None = None


@dataclass(frozen=True, slots=True)
class Seen:
    """What the outside sees of a reaction: flows taken, and what is open when it is over."""

    flows: tuple[tuple[str, int], ...]
    open_tasks: tuple[tuple[str, int], ...]
    awaited: tuple[str, ...]
    outcome: str | None


class Reference:
    """Plays one model.

    `limit`: states that one reaction may have, over all orders of its steps; `budget`: states of
    all reactions that are asked for.
    """

    def __init__(self, model: Level, limit: int = 400, budget: int = 100_000) -> None:
        self.model = model
        self.limit = limit
        self.budget = budget
        self._competing = competing(model)

    def begin(self) -> list[Marking]:
        """The markings at rest that a run may begin with."""
        marking = Marking()
        marking.root = Scope(marking.next_number(), self.model, None)
        for node in self.model.begins:
            marking.root.tokens[birth(node.id)] += 1
        return self._rest([marking])

    def choices(self, marking: Marking, given: Input) -> list[list[Marking]]:
        """The reactions to an input, one for each open task that the answer may be meant for."""
        marking = marking.copy()
        marking.taken.clear()
        if given.kind == "signal":
            return [self._rest(broadcast(marking, given.name))]
        reactions = []
        for work in marking.works():
            if work.node.kind == "user" and work.node.id == given.name:
                after = marking.copy()
                if given.value is not None:
                    after.answers[given.name] = given.value
                answered = after.work(work.number)
                assert answered is not None
                finish(after, answered)
                reactions.append(self._rest([after]))
        return reactions

    def _rest(self, begin: list[Marking]) -> list[Marking]:
        resting = {}
        for marking in begin:
            enter_what_waits(marking)
        for marking in {marking.key(): marking for marking in begin}.values():
            alone = self._in_one_order(marking)
            for rest in [alone] if alone is not None else self._in_every_order(marking):
                _name_the_end(rest)
                resting[rest.key()] = rest
        return list(resting.values())

    def _in_one_order(self, marking: Marking) -> Marking | None:
        """The only rest there is, if no two steps compete on the way; None: they may.

        A step that does not compete stays possible until it is taken, and does the same then, so
        one order of such steps tells of all, as long as none that competes becomes possible.
        """
        for _ in range(self.limit):
            if self._may_compete(marking):
                return None
            possible = steps(marking)
            if not possible:
                return marking
            if any(step.node in self._competing for step in possible):
                return None
            marking = take(marking, possible[0])[0]
        raise TooLargeError

    def _may_compete(self, marking: Marking) -> bool:
        """Whether a join that looks at other tokens has one of its own."""
        return any(
            scope.fired
            or any(
                scope.tokens[flow]
                for node in scope.level.nodes
                if node.kind in ("inclusive", "complex") and len(scope.level.entries[node.id]) > 1
                for flow in scope.level.entries[node.id]
            )
            for scope in marking.scopes()
        )

    def _in_every_order(self, begin: Marking) -> list[Marking]:
        seen: set[Key] = {begin.key()}
        todo = [begin]
        resting = []
        while todo:
            marking = todo.pop()
            possible = steps(marking)
            if not possible:
                resting.append(marking)
            for step in possible:
                for after in take(marking, step):
                    key = after.key()
                    if key not in seen:
                        seen.add(key)
                        todo.append(after)
            self.budget -= 1
            if len(seen) > self.limit or self.budget < 0:
                raise TooLargeError
        return resting


def _name_the_end(marking: Marking) -> None:
    if marking.root is not None and not open_tasks(marking) and not awaited(marking):
        marking.outcome = "stuck"


def open_tasks(marking: Marking) -> tuple[tuple[str, int], ...]:
    """The user tasks that are to be answered, how often each."""
    counts: dict[str, int] = {}
    for work in marking.works():
        if work.node.kind == "user":
            counts[work.node.id] = counts.get(work.node.id, 0) + 1
    return tuple(sorted(counts.items()))


def awaited(marking: Marking) -> tuple[str, ...]:
    """The signals that something catches now."""
    return tuple(sorted({catcher.signal for catcher in catchers(marking)}))


def seen(marking: Marking) -> Seen:
    """What the outside sees of a marking at rest, and of the way to it."""
    if marking.outcome is not None:
        return Seen(marking.seen(), (), (), marking.outcome)
    return Seen(marking.seen(), open_tasks(marking), awaited(marking), None)


def competing(model: Level) -> frozenset[str]:
    """Nodes of which a step can end or change what others are about to do.

    They throw something, or an error when no flow is true, or end their other instances.
    """
    found = set()
    for level in levels(model):
        for node in level.nodes:
            throws = node.event is not None and (
                node.kind == "end" or (node.kind == "throw" and node.event.kind != "link")
            )
            ends_others = isinstance(node.repeat, Many) and node.repeat.enough is not None
            flows = level.outgoing[node.id]
            no_flow = bool(flows) and node.default is None and all(f.condition for f in flows)
            if throws or ends_others or no_flow:
                found.add(node.id)
    return frozenset(found)
