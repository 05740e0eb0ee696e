"""Restrict a net to the runs in which assumptions hold.

Left out are transitions from outside, and nothing is added: each run of the restricted net is one
of the full net. What stays enabled instead (the success of a behavior, an answer, a message) keeps
tasks from waiting for ever.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from m2pem.fleet.fleet import Fleet
from m2pem.mission import elements as e
from m2pem.mission.events import TimerEventDefinition
from m2pem.mission.mission import Mission
from m2pem.verify.assumptions import Assumptions
from m2pem.verify.net.petri_net import PetriNet, Place, Role, Transition, Trigger
from m2pem.verify.translate.moving import is_refused
from m2pem.verify.translate.timers import fixed


def restrict(net: PetriNet, mission: Mission, fleet: Fleet, assumptions: Assumptions) -> PetriNet:
    """Return the net with the runs alone in which the assumptions hold."""
    if not assumptions:
        return net
    transitions: Iterable[Transition] = net.transitions
    if assumptions.failures == 0:
        transitions = [each for each in transitions if not _may_not_happen(net, each)]
    if assumptions.reliable:
        safe = assumptions.resources(fleet)
        transitions = [part for each in transitions for part in _unreliable(net, each, safe)]
    if assumptions.operators_answer:
        transitions = [each for each in transitions if not _before_an_answer(mission, each)]
    if assumptions.messages_within_us is not None:
        awaited = _awaiting_places(net, mission)
        transitions = [
            each
            for each in transitions
            if not _later_than(mission, each, awaited, assumptions.messages_within_us)
        ]
    restricted = replace(
        net, transitions=tuple(replace(each, index=n) for n, each in enumerate(transitions))
    )
    if assumptions.failures:
        return _counted(restricted, assumptions.failures)
    return restricted


# --- failures -------------------------------------------------------------------------------------


def _may_not_happen(net: PetriNet, transition: Transition) -> bool:
    """Whether it is a failure of a behavior or service that could also have succeeded.

    A behavior that was refused a shared space can only fail.
    """
    refused = any(is_refused(net.places[place]) for place in transition.read)
    return transition.trigger is Trigger.FAILS and not refused


def _counted(net: PetriNet, most: int) -> PetriNet:
    """Let each failure take a token from a place that has `most` at first."""
    left = len(net.places)
    place = Place(left, "failures~left", net.process, 0, Role.CONTROL, several=most > 1, most=most)

    def counted(transition: Transition) -> Transition:
        if _may_not_happen(net, transition):
            transition = replace(transition, consume=(*transition.consume, (left, 1)))
        if any(place in net.ends for place, _ in transition.produce):
            # How many were left makes no difference any more.
            transition = replace(transition, reset=(*transition.reset, left))
        return transition

    return replace(
        net,
        places=(*net.places, place),
        transitions=tuple(map(counted, net.transitions)),
        initial=(*net.initial, (left, most)),
        single=None,
    )


def _unreliable(
    net: PetriNet, transition: Transition, reliable: frozenset[str]
) -> Iterator[Transition]:
    """Yield what is left of a failure: the same where its task has something that may fail."""
    if not _may_not_happen(net, transition):
        yield transition
        return
    taken = {*(place for place, _ in transition.consume), *transition.read}
    at_work = [n for n in taken if net.places[n].role is Role.ACTIVE]
    named = {each for n in at_work for each in net.places[n].resources}
    holds = [each for each in net.places if each.holder in at_work and _held(net, each)]
    if (not named and not holds) or not named <= reliable:
        yield transition  # a service, or a behavior that needs nothing
        return
    before: list[int] = []
    for place in holds:
        if set(_held(net, place)) <= reliable or place.index in transition.inhibit:
            continue
        yield replace(
            transition,
            name=f"{transition.name}.{len(before) + 1}",
            read=tuple(sorted({*transition.read, place.index})),
            inhibit=tuple(sorted({*transition.inhibit, *before})),
        )
        before.append(place.index)


def _held(net: PetriNet, place: Place) -> tuple[str, ...]:
    """The resources of which a token on a place is one: those of its pool, if it names none."""
    if place.resources:
        return place.resources
    for target in place.returns:
        if pool := net.places[target].free or net.places[target].kept:
            return pool
    return ()


# --- timers ---------------------------------------------------------------------------------------


def _before_an_answer(mission: Mission, transition: Transition) -> bool:
    """Whether it is a timer of a user task: such a task does nothing but wait for its answer."""
    if transition.trigger is not Trigger.TIMER:
        return False
    element = mission.elements.get(transition.element)
    if isinstance(element, e.BoundaryEvent):
        element = element.attached_to
    return isinstance(element, e.UserTask)


def _awaiting_places(net: PetriNet, mission: Mission) -> frozenset[int]:
    """The places of tokens that go on when a signal or message comes from outside.

    Those at boundary events and event subprocesses do not count: the token does not wait for them.
    """
    found: set[int] = set()
    for each in net.transitions:
        if each.trigger not in (Trigger.SIGNAL, Trigger.MESSAGE):
            continue
        caught = [place for place, _ in each.produce]
        pairs = [(waiting, came) for waiting, _ in each.consume for came in caught]
        for waiting, came in (*pairs, *each.moves):
            catcher = mission.elements.get(net.places[came].element)
            if (
                net.places[waiting].role is Role.ACTIVE
                and net.places[came].role is Role.TRIGGERED
                and isinstance(catcher, e.IntermediateCatchEvent | e.ReceiveTask)
            ):
                found.add(waiting)
    return frozenset(found)


def _later_than(
    mission: Mission, transition: Transition, awaited: frozenset[int], within_us: int
) -> bool:
    """Whether it is a timer that begins with the wait for a message, and is due after it comes.

    Of a loop, each message comes in time, and the loop's timers may be due all the same.
    """
    due_us = transition.due_us
    if transition.trigger is not Trigger.TIMER or due_us is None or due_us <= within_us:
        return False
    element = mission.elements.get(transition.element)
    if isinstance(element, e.BoundaryEvent) and element.attached_to.loop is not None:
        return False
    if not isinstance(element, e.Event) or any(
        isinstance(each, TimerEventDefinition) and fixed(each) is None
        for each in element.definitions
    ):
        return False
    taken = {*(place for place, _ in transition.consume), *transition.read}
    return not taken.isdisjoint(awaited)
