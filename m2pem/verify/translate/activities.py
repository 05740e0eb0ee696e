"""Tasks and other activities: their beginning, their work, and how it ends."""

from dataclasses import replace

from m2pem.engine.execution import Waits, waits_when_entered
from m2pem.mission import elements as e
from m2pem.mission.behavior import Assignment, Behavior
from m2pem.mission.expression.expression import literal
from m2pem.units import Dimension, UnitError, quantity
from m2pem.verify.net.petri_net import BEGINS, Action, Exactness, Flag, Kind, Role, Step, Trigger
from m2pem.verify.translate import subprocesses
from m2pem.verify.translate.catching import boundaries, caught_before_work
from m2pem.verify.translate.compensation import noted
from m2pem.verify.translate.context import Host, Making, behavior_of, catching, held_by, resources
from m2pem.verify.translate.loops import looped
from m2pem.verify.translate.net_builder import Area, Effect, at, product
from m2pem.verify.translate.sequence_flows import leave
from m2pem.verify.translate.throwing import (
    catchable,
    interrupting_places,
    message_effects,
    parted,
    throw_error,
)
from m2pem.verify.translate.timers import due_us, runs, written


def activity(making: Making, node: e.FlowNode, area: Area) -> None:
    """A token comes to an activity, works, and leaves."""
    assert isinstance(node, e.Activity)
    net = making.net
    inside = net.area(node, area)
    inside.several = area.several or node in making.repeated
    held, behavior = held_by(making, node)
    repeated = node in making.repeated
    active = net.place(node, area, Role.ACTIVE, several=repeated, resources=held, behavior=behavior)
    host = Host(node, area, inside, active, lambda: [])
    host.done = lambda: pass_on(making, host)
    host.cut = lambda: pass_on(making, host, well=False)
    inside.host = host
    boundaries(making, host)
    come = Effect(
        steps=(Step(node.id, Action.ENTERED),),
        consume=(at(net, node, area),) * node.start_quantity,
    )
    waits = waits_when_entered(node)
    host.armed_before = waits is Waits.AT_ITS_BOUNDARY and not isinstance(node, e.UserTask)
    begun = looped(making, host, work) if node.loop is not None else work(making, host)
    if host.armed_before:
        _arm_before_work(making, host, come, begun)
        return
    making.rules(product([come], begun))
    if waits is not Waits.NOTHING:
        net.at_once.add(at(net, node, area))


def _arm_before_work(making: Making, host: Host, come: Effect, begun: list[Effect]) -> None:
    """The boundary events are armed as the token comes, and the work begins in its turn."""
    net, node = making.net, host.node
    net.at_once.add(at(net, node, host.outer))
    later = begun[0].produce if len(begun) == 1 else ()
    only_brings = len(begun) == 1 and begun[0] == Effect(produce=later)
    if only_brings and host.active in later:
        # Its instances begin each in its turn: what interrupts it finds it at work already.
        making.rules(product([replace(come, produce=tuple(host.armed))], begun))
        return
    if only_brings and len(later) == 1:
        due = later[0]  # a behavior or message: its work is to begin as it is
    else:
        due = net.place(node, host.outer, Role.ENTERING, f":due{host.inside.index}")
        for effect in begun:
            over = host.active not in effect.produce
            ended = frozenset({host.inside.index}) if over else frozenset()
            begins = () if effect.steps else (Step(node.id, Action.ENTERED, BEGINS),)
            making.rules(product([Effect(begins, (due,), kill_scopes=ended)], [effect]))
    armed = come.then(Effect(produce=(due, *host.armed)))
    assert armed is not None
    net.rule(armed)
    caught_before_work(making, replace(host, active=due, armed=[]))


def pass_on(making: Making, host: Host, *, well: bool = True) -> list[Effect]:
    """An activity is done: it leaves by its flows. Its token is taken off already.

    `well`: it was not ended early, so that it can be undone.
    """
    node = host.node
    ways = [noted(making, host) if well else Effect()]
    for mapping in node.data_flow.outputs:
        ways = making.data.write(ways, mapping.target, None, host.outer, node)
    if node.for_compensation:
        return ways
    out = leave(
        making,
        host.outer,
        node,
        node.default,
        lambda code: throw_error(making, host.outer, node, host, code),
        times=node.completion_quantity,
    )
    if isinstance(node.container, e.AdHocSubProcess):
        asked = making.net.place(node.container, host.outer, Role.ENTERING, ":asked")
        if node.container.active_elements is None and node.container.entries:
            ways = product(ways, [Effect(produce=(asked,))])
    return product(ways, out)


# --- work ---------------------------------------------------------------------------------------


def work(making: Making, host: Host) -> list[Effect]:
    """What an activity, or an instance of one, does when it begins."""
    node = host.node
    behavior = behavior_of(node)
    if behavior is not None:
        return _behavior(making, host, behavior)
    match node:
        case e.UserTask():
            return _user_task(making, host, node)
        case e.ScriptTask():
            return _script(making, host, node)
        case e.ServiceTask(call=call) if call is not None:
            return _outside_work(making, host)
        case e.SendTask(message=message) if message is not None:
            return _send(making, host, message.id)
        case e.ReceiveTask(message=message) if message is not None:
            return _receive(making, host, node)
        case e.AdHocSubProcess():
            return subprocesses.ad_hoc(making, host)
        case e.SubProcess():
            return subprocesses.subprocess(making, host)
        case e.CallActivity():
            return subprocesses.call(making, host)
        case _:
            return _at_once(host)


def _at_once(host: Host) -> list[Effect]:
    stop = Effect(steps=(Step(host.node.id, Action.COMPLETED),))
    return product([stop], host.done())


def failing(making: Making, host: Host, code: str, flag: Flag) -> list[Effect]:
    """An activity fails, its token being taken off already."""
    return throw_error(making, host.outer, host.node, host, code, flag)


def _behavior(making: Making, host: Host, behavior: Behavior) -> list[Effect]:
    net = making.net
    if not behavior.roles and behavior.name == "hold":
        done = _ended(host, host.leave())
        after_us = _hold_us(behavior)
        made = [
            net.rule(effect, Kind.OUTSIDE, Trigger.TIMER, due_us=after_us)
            for effect in product([done], host.done())
        ]
        runs(making, host.active, after_us, (host.active,), made)
        return [host.begin()]
    held = resources(making, behavior)
    if not held:
        return failing(making, host, "RESOURCE_UNAVAILABLE", Flag.UNCAUGHT)
    _outside_work(making, host)
    wants = net.place(node_of(host), host.outer, Role.ENTERING, f":wants{host.inside.index}")
    making.contended.append((host, wants, held))
    return [Effect(produce=(wants,))]


def node_of(host: Host) -> e.Activity:
    """The activity itself."""
    return host.node


def contend(making: Making) -> None:
    """A behavior begins when nobody holds what it wants; else it fails at once."""
    net = making.net
    for host, wants, held in making.contended:
        holders = {n: r for r in held for n in net.holders.get(r, ())}
        begins = Effect(
            steps=(Step(host.node.id, Action.ENTERED, "commands"),),
            consume=(wants,),
            inhibit=frozenset(holders),
        ).then(host.begin())
        assert begins is not None
        net.rule(begins)
        for holder, resource in holders.items():
            refused = Effect(
                consume=(wants,),
                read=frozenset({holder}),
                flag=Flag.CONFLICT,
                flagged=resource,
            )
            fails = failing(making, host, "RESOURCE_UNAVAILABLE", Flag.CONFLICT)
            for effect in product([refused], fails):
                net.rule(effect)


def _hold_us(behavior: Behavior) -> int | None:
    for parameter in behavior.parameters:
        if parameter.name == "duration" and isinstance(parameter.value, str):
            try:
                return round(quantity(parameter.value, Dimension.DURATION) * 1_000_000)
            except UnitError:
                return None
    return 0 if not any(p.name == "duration" for p in behavior.parameters) else None


def _ended(host: Host, effect: Effect) -> Effect:
    return effect.saying(host.node.id, Action.COMPLETED)


def _outside_work(making: Making, host: Host) -> list[Effect]:
    """A behavior or service: it ends well or badly, when its report comes."""
    net = making.net
    well = [_ended(host, host.leave())]
    badly = Effect(consume=(host.active,))
    for key in making.data.written_anyhow(host.node):
        well = making.data.write(well, key, None, host.outer, host.node)
    for effect in product(well, host.done()):
        net.rule(effect, Kind.OUTSIDE, Trigger.SUCCEEDS)
    if making.options.failures:
        codes = dict.fromkeys((*catchable(making, host.outer, host), "FAILED"))
        for code in codes:
            for effect in failing(making, host, code, Flag.UNCAUGHT_FAILURE):
                both = badly.then(effect)
                if both is not None:
                    net.rule(both, Kind.OUTSIDE, Trigger.FAILS, code)
    return [host.begin()]


def _user_task(making: Making, host: Host, node: e.UserTask) -> list[Effect]:
    net = making.net
    assert node.prompt is not None
    prompt = node.prompt
    for decision in prompt.decisions:
        answered = [_ended(host, host.leave())]
        answered = making.data.write(
            answered, prompt.store, literal(decision.value), host.outer, node
        )
        for effect in product(answered, host.done()):
            net.rule(effect, Kind.OUTSIDE, Trigger.ANSWER, decision.value)
    if prompt.timeout is not None:
        late = Effect(consume=(host.active,))
        made = [
            net.rule(effect, Kind.OUTSIDE, Trigger.TIMER, due_us=due_us(prompt.timeout))
            for effect in product(
                [late], failing(making, host, "PROMPT_TIMEOUT", Flag.UNCAUGHT_FAILURE)
            )
        ]
        runs(making, host.active, written(prompt.timeout), (host.active,), made)
    return [host.begin()]


def _script(making: Making, host: Host, node: e.ScriptTask) -> list[Effect]:
    ways = [Effect()]
    unable: list[Effect] = []
    thrown = ""
    for statement in node.script.statements if node.script is not None else ():
        if not isinstance(statement, Assignment):
            thrown = statement.code
            break
        if making.data.is_blurred(statement.key):
            making.net.approximate(
                node, Exactness.MORE, f"'{statement.key}' has more values than are told apart"
            )
        ways = making.data.write(
            ways, statement.key, statement.expression, host.outer, node, unable=unable
        )
    over = failing(making, host, thrown, Flag.UNCAUGHT) if thrown else _at_once(host)
    if not unable:
        return product(ways, over)
    wrong = failing(making, host, "EXPRESSION", Flag.UNCAUGHT)
    return [*product(ways, over), *product(unable, wrong)]


def _send(making: Making, host: Host, message: str) -> list[Effect]:
    """Between coming and leaving, so that who receives is known when it is thrown."""
    thrown = making.net.place(host.node, host.outer, Role.ENTERING, f":sends{host.inside.index}")

    def spell_out() -> None:
        sends = Effect(steps=(Step(host.node.id, Action.THROWN, message),), consume=(thrown,))
        over = Effect(kill_scopes=frozenset({host.inside.index}))
        around = interrupting_places(making, "message", message, host.outer)
        ended, gone_on = parted(product([sends], message_effects(making, message)), around)
        ended += [
            replace(sends, produce=(catcher.told,))
            for catcher in making.messages.get(message, ())
            if catcher.waiting == thrown and not catcher.keeps
        ]
        making.rules(ended)
        making.rules(product(product(gone_on, [over]), _at_once(host)))

    making.later.append(spell_out)
    return [Effect(produce=(thrown,))]


def _receive(making: Making, host: Host, node: e.ReceiveTask) -> list[Effect]:
    told = making.net.place(node, host.outer, Role.TRIGGERED, f":{host.inside.index}")
    assert node.message is not None
    catching(making, "message", node.message.id, host.active, told, False, node)
    stop = Effect(consume=(told,), kill_scopes=frozenset({host.inside.index}))
    come = making.data.receive([_ended(host, stop)], host.outer, node)
    making.rules(product(come, host.done()))
    return [host.begin()]
