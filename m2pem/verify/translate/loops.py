"""Standard loops and multi-instance activities."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from m2pem.errors import ExpressionError
from m2pem.mission.loops import InstanceBehavior, MultiInstance, StandardLoop
from m2pem.verify.net.petri_net import Action, Exactness, Flag, Role, Step
from m2pem.verify.translate.compensation import forget_instances, noted_instance
from m2pem.verify.translate.context import Host, Making, behavior_of, resources
from m2pem.verify.translate.data import ERROR, Truth
from m2pem.verify.translate.net_builder import Effect, product
from m2pem.verify.translate.throwing import throw_error

Work = Callable[[Making, Host], list[Effect]]


def looped(making: Making, whole: Host, work: Work) -> list[Effect]:
    """What an activity with a loop does when a token comes to it."""
    loop = whole.node.loop
    if isinstance(loop, StandardLoop):
        return _rounds(making, whole, loop, work)
    assert isinstance(loop, MultiInstance)
    if loop.behavior is not InstanceBehavior.ALL:
        making.net.approximate(
            whole.node, Exactness.BOUNDED, "what its instances throw when they end is not thrown"
        )
    count = _count(loop)
    if count == 0:
        return whole.done()
    if loop.sequential:
        return _in_turn(making, whole, loop, work, count)
    return _at_a_time(making, whole, loop, work, count)


def _count(loop: MultiInstance) -> int | None:
    """How many instances there are, if the mission says so."""
    expression = loop.collection if loop.collection is not None else loop.cardinality
    if expression is None or not expression.constant:
        return None
    try:
        value = expression.evaluate(lambda _: None)
    except ExpressionError:
        return None
    if isinstance(value, list):
        return len(value)
    return value if isinstance(value, int) and value >= 0 else None


def _instance(making: Making, whole: Host, number: int, several: bool = False) -> Host:
    """One instance: its token is in the area of the whole."""
    node, net = whole.node, making.net
    behavior = behavior_of(node)
    held = resources(making, behavior) if behavior is not None else None
    suffix = f"[{number}]"
    active = net.place(
        node,
        whole.inside,
        Role.ACTIVE,
        suffix,
        several=several,
        resources=held or (),
        behavior=behavior.name if behavior is not None and held else "",
    )
    inside = net.area(node, whole.inside, step=f"{node.id}{suffix}")
    host = Host(node, whole.inside, inside, active, lambda: [], boundary=False)
    inside.host = host
    return host


def _over(whole: Host) -> list[Effect]:
    """The whole is done: its token and all that is inside go."""
    over = whole.leave().saying(whole.node.id, Action.COMPLETED)
    return product([over], whole.done())


def _begin_instance(work: Work, making: Making, host: Host) -> list[Effect]:
    entered = Effect(steps=(Step(host.node.id, Action.ENTERED, "an instance"),))
    return product([entered], work(making, host))


class _Turns:
    """Instances one after the other. `next_at`: where a token says that one has ended."""

    def __init__(self, making: Making, whole: Host, work: Work) -> None:
        self.host = _instance(making, whole, 0)
        self.begins = making.net.place(whole.node, whole.inside, Role.ENTERING, ":round")
        self.ended = making.net.place(whole.node, whole.inside, Role.ENTERING, ":rounded")
        self.host.cut = self.ends
        self.host.done = lambda: product([noted_instance(making, self.host, 0)], self.ends())
        for effect in product(
            [Effect(consume=(self.begins,))], _begin_instance(work, making, self.host)
        ):
            making.net.rule(effect)

    def ends(self) -> list[Effect]:
        """A round has ended."""
        return [Effect(produce=(self.ended,))]


def _rounds(making: Making, whole: Host, loop: StandardLoop, work: Work) -> list[Effect]:
    turns = _Turns(making, whole, work)
    node = whole.node
    most = loop.maximum
    counted = most is not None and most <= making.options.most_instances
    if most is not None and not counted:
        making.net.approximate(node, Exactness.MORE, f"the maximum of {most} rounds is not counted")
    rounds = [
        making.net.place(node, whole.inside, Role.CONTROL, f":{n + 1}")
        for n in range(most if counted and most is not None else 0)
    ]
    again = Effect(consume=(turns.ended,), produce=(turns.begins,))
    stop = Effect(consume=(turns.ended,))
    for guard, goes_on in _asked(making, whole, loop):
        when = Effect(guard=guard)
        if goes_on == ERROR:
            ways = throw_error(making, whole.outer, node, whole, "EXPRESSION", Flag.UNCAUGHT)
            ways = product(
                [
                    stop,
                ],
                product([Effect(consume=(whole.active,))], ways),
            )
        elif not goes_on:
            ways = product([stop], _over(whole))
        elif not rounds:
            ways = [again]
        else:
            ways = [
                Effect(consume=(turns.ended, rounds[n]), produce=(turns.begins, rounds[n + 1]))
                for n in range(len(rounds) - 1)
            ]
        making.rules(product([when.saying(node.id, Action.COMPLETED, "a round")], ways))
    if rounds:
        last = Effect(consume=(turns.ended, rounds[-1]))
        making.rules(product([last.saying(node.id, Action.COMPLETED, "a round")], _over(whole)))
    begun = Effect(produce=(turns.begins, *rounds[:1])).then(whole.begin())
    assert begun is not None
    begun = replace(begun, kill=forget_instances(making, whole, 1).kill)
    if most == 0:
        return whole.done()
    if not loop.test_before or loop.condition is None:
        return [begun]
    found: list[Effect] = []
    for guard, goes_on in _asked(making, whole, loop):
        ways = [begun] if goes_on is True else whole.done()
        if goes_on == ERROR:
            ways = throw_error(making, whole.outer, node, whole, "EXPRESSION", Flag.UNCAUGHT)
        found += product([Effect(guard=guard)], ways)
    return found


def _asked(
    making: Making, whole: Host, loop: StandardLoop
) -> list[tuple[dict[int, frozenset[int]], Truth]]:
    if loop.condition is None:
        return [({}, True)]
    if not making.data.is_followed([loop.condition], whole.node):
        making.net.approximate(whole.node, Exactness.MORE, "how often it goes round is not known")

    def first(truths: Sequence[Truth]) -> Truth:
        return truths[0]

    return making.data.cases([loop.condition], whole.outer, whole.node, first)


def _in_turn(
    making: Making, whole: Host, loop: MultiInstance, work: Work, count: int | None
) -> list[Effect]:
    turns = _Turns(making, whole, work)
    node = whole.node
    again = Effect(consume=(turns.ended,), produce=(turns.begins,))
    stop = Effect(consume=(turns.ended,))
    counted = count is not None and count <= making.options.most_instances
    rounds: list[int] = []
    if counted:
        assert count is not None
        rounds = [
            making.net.place(node, whole.inside, Role.CONTROL, f":{n + 1}") for n in range(count)
        ]
        for n in range(count - 1):
            goes_on = Effect(consume=(rounds[n],), produce=(rounds[n + 1],)).then(again)
            assert goes_on is not None
            making.rules([goes_on.saying(node.id, Action.COMPLETED, "an instance")])
        last = Effect(consume=(rounds[-1],)).then(stop)
        assert last is not None
        making.rules(product([last], _over(whole)))
    else:
        making.net.approximate(node, Exactness.MORE, "how many instances there are is not known")
        making.rules([again.saying(node.id, Action.COMPLETED, "an instance")])
    if loop.completion is not None or not counted:
        making.rules(product([stop.saying(node.id, Action.COMPLETED, "an instance")], _over(whole)))
        if loop.completion is not None:
            making.net.approximate(
                node, Exactness.MORE, "its completion condition may be true at any instance's end"
            )
    begun = Effect(produce=(turns.begins, *rounds[:1])).then(whole.begin())
    assert begun is not None
    begun = replace(begun, kill=forget_instances(making, whole, 1).kill)
    return [begun] if counted else [begun, *whole.done()]


def _well(
    making: Making, host: Host, number: int, ends: list[Effect]
) -> Callable[[], list[Effect]]:
    """How an instance ends that can be undone."""
    return lambda: product([noted_instance(making, host, number)], ends)


def _at_a_time(
    making: Making, whole: Host, loop: MultiInstance, work: Work, count: int | None
) -> list[Effect]:
    node = whole.node
    known = count is not None and count <= making.options.most_instances
    total = count if known and count is not None else making.options.instances
    if not known:
        making.net.approximate(
            node,
            Exactness.BOUNDED,
            f"checked with up to {total} instances" + ("" if count is None else f", of {count}"),
        )
    hosts = [_instance(making, whole, number) for number in range(total)]
    begins = [making.net.place(node, whole.inside, Role.ENTERING, f"[{n}]") for n in range(total)]
    ends = [Effect()]
    if loop.completion is not None:
        making.net.approximate(
            node, Exactness.MORE, "its completion condition may be true at any instance's end"
        )
        enough = making.net.place(node, whole.inside, Role.TRIGGERED, ":enough")
        ends.append(Effect(produce=(enough,)))
        making.rules(product([Effect(consume=(enough,))], _over(whole)))
    for number, (host, begin) in enumerate(zip(hosts, begins, strict=True)):
        host.cut = lambda: ends
        host.done = _well(making, host, number, ends)
        for effect in product([Effect(consume=(begin,))], _begin_instance(work, making, host)):
            making.net.rule(effect)
    quiet = Effect(quiet_scopes=frozenset({whole.inside.index}))
    making.rules(product([quiet], _over(whole)))
    sizes = [total] if known else range(total + 1)
    found: list[Effect] = []
    for size in sizes:
        if size == 0:
            found += whole.done()
            continue
        begun = whole.begin().then(Effect(produce=tuple(begins[:size])))
        assert begun is not None
        begun = replace(begun, kill=forget_instances(making, whole, total).kill)
        found.append(begun)
    return found
