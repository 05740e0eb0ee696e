"""Entering what waits is waiting: a token comes to a place from which nothing thrown is missed.

A rule that brings a token to an element which waits does, in the same step, what the element's own
first rule does (`m2pem.engine.arming`).
"""

from collections.abc import Sequence

from m2pem.verify.system import Kind
from m2pem.verify.translate.effect import Effect
from m2pem.verify.translate.net import Draft, Net


def enter_at_once(net: Net, initial: Sequence[int]) -> tuple[int, ...]:
    """Join the first rule of what waits with each rule that leads to it.

    Gives the places that have a token at first.
    """
    entries = {place: draft for place in net.at_once if (draft := _entry(net, place)) is not None}
    needed: set[int] = set()
    """Places to which some rule still brings a token without what follows."""
    for draft in net.drafts:
        draft.effect = _joined(net, draft.effect, entries, needed)
    first = _joined(net, Effect(produce=tuple(initial)), entries, needed)
    over = {id(entry) for place, entry in entries.items() if place not in needed}
    net.drafts = [draft for draft in net.drafts if id(draft) not in over]
    return first.produce


def _entry(net: Net, place: int) -> Draft | None:
    """The one rule that takes a token from a place, if it asks for nothing else."""
    takes = [draft for draft in net.drafts if place in draft.effect.consume]
    if len(takes) != 1 or takes[0].kind is not Kind.INTERNAL:
        return None
    effect = takes[0].effect
    asks = effect.read or effect.inhibit or effect.quiet_scopes or effect.guard
    does_more = effect.moves or effect.copies or effect.kill_scopes or effect.flag is not None
    return None if effect.consume != (place,) or asks or does_more else takes[0]


def _joined(net: Net, effect: Effect, entries: dict[int, Draft], needed: set[int]) -> Effect:
    waiting = [place for place in effect.produce if place in entries]
    while waiting:
        place = waiting.pop()
        entry = entries[place].effect
        rest = list(effect.produce)
        rest.remove(place)
        if not entry.kill.isdisjoint(rest) or not entry.assign.keys().isdisjoint(effect.assign):
            needed.add(place)
            continue
        effect = Effect(
            effect.steps + entry.steps,
            effect.consume,
            effect.read,
            effect.inhibit,
            effect.quiet_scopes,
            effect.moves,
            effect.copies,
            effect.kill | entry.kill,
            effect.kill_scopes,
            (*rest, *entry.produce),
            effect.guard,
            {**effect.assign, **entry.assign},
            effect.flag,
            effect.flagged,
        )
        waiting += [each for each in entry.produce if each in entries]
    return effect
