"""The reference of a team behavior in the journal, and its parts after a restart."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import msgspec

from m2pem.api.arbiter import Arbiter, BehaviorReport, BehaviorRequest
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.values import Value
from m2pem.teams.plan import Plan


@dataclass(frozen=True, slots=True)
class Transfer:
    """A piece of a lost member's share: who does it, by which behavior with which parameters, as
    missions give them."""

    member: ResourceId
    behavior: str
    parameters: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Reference:
    """`begun`: the arbiters' own references of parts that have begun. `done`: parts that have
    succeeded. `lost`: members that the team goes on without, and why. `version`: the number of
    changes. `split`: the members' shares, for a plan that divides its work. `transfers`: pieces of
    lost members' shares, `given_up`: shares that no member does as a whole any more, `left`: the
    parameters of what was left of others, all by the names of `Partition`.
    """

    begun: Mapping[str, str | None] = field(default_factory=dict)
    done: tuple[str, ...] = ()
    lost: Mapping[ResourceId, str] = field(default_factory=dict)
    version: int = 0
    split: tuple[float, ...] = ()
    transfers: Mapping[str, Transfer] = field(default_factory=dict)
    given_up: tuple[str, ...] = ()
    left: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)

    def text(self) -> str:
        """Return it as JSON, for the journal."""
        return msgspec.json.encode(self).decode()


def read_reference(text: str | None) -> Reference:
    """Read the text of `Reference.text`; return an empty one if there is none or it is invalid."""
    try:
        return msgspec.json.decode(text or "{}", type=Reference)
    except msgspec.MsgspecError:
        return Reference()


QUERY_TIMEOUT_S = 8.0
"""Less than the timeout of a query to the team itself."""

_GOOD = (BehaviorState.ACCEPTED, BehaviorState.RUNNING, BehaviorState.SUCCEEDED)

_log = logging.getLogger("m2pem.teams")


@dataclass(frozen=True, slots=True)
class FoundParts:
    """`reports`: reports of the parts that had begun, by part. `gap`: names the parts that are not
    known; "" if all are."""

    reports: Mapping[str, BehaviorReport]
    gap: str = ""

    @property
    def good(self) -> Mapping[str, BehaviorReport]:
        """The parts that are running or have succeeded."""
        return {part: each for part, each in self.reports.items() if each.state in _GOOD}

    def held(self, *, marches: bool) -> bool:
        """Whether a run or an operator holds the team. On a march, members are halted to keep
        their places, but never all at once."""
        going = [each.held for each in self.reports.values() if not each.state.terminal]
        return bool(going) and (all(going) if marches else any(going))

    def trimmed(self, kept: Reference) -> Reference:
        """Return the reference without the parts that cannot go on: they are not queried again."""
        return replace(kept, begun={p: ref for p, ref in kept.begun.items() if p in self.good})


async def look_for_parts(
    request: BehaviorRequest,
    plan: Plan,
    kept: Reference,
    arbiter_of: Callable[[ResourceId], Arbiter],
) -> FoundParts:
    """Query the arbiters for every part that has begun, or may have.

    A part that the journal does not know may have begun just before the crash; if its arbiter does
    not know it either, it has not.
    """
    known = {*kept.lost, *map(_doer, kept.begun)}
    planned = dict.fromkeys(leg.member for leg in plan.legs if leg.member not in known)
    given = [f"{each.member}/{key}" for key, each in kept.transfers.items()]
    parts = dict.fromkeys([*kept.begun, *planned, *given])
    asked = [part for part in parts if _doer(part) not in kept.lost and part not in kept.done]
    answers = await asyncio.gather(
        *(_ask(request.id, part, kept.begun.get(part), arbiter_of) for part in asked)
    )
    reports: dict[str, BehaviorReport] = {
        part: BehaviorReport(f"{request.id}.{part}", 3, BehaviorState.SUCCEEDED)
        for part in kept.done
    }
    gaps: list[str] = []
    for part, answer in zip(asked, answers, strict=True):
        if answer.state is BehaviorState.UNKNOWN and part not in kept.begun:
            continue
        reports[part] = answer
        if answer.state is BehaviorState.UNKNOWN:
            why = answer.reason or answer.code or "no reason given"
            gaps.append(f"the part of {_doer(part)} is {answer.state.value}: {why}")
    if not reports and plan.legs:
        gaps.append("no member knows of it")
    return FoundParts(reports, "; ".join(gaps))


def _doer(part: str) -> ResourceId:
    return ResourceId(part.partition("/")[0])


async def _ask(
    behavior: str, part: str, native_ref: str | None, arbiter_of: Callable[[ResourceId], Arbiter]
) -> BehaviorReport:
    name = f"{behavior}.{part}"
    try:
        async with asyncio.timeout(QUERY_TIMEOUT_S):
            return await arbiter_of(_doer(part)).query(name, native_ref)
    except TimeoutError:
        reason = f"its arbiter did not answer within {QUERY_TIMEOUT_S:g} s"
    except Exception as error:  # an arbiter's fault is a part that is not known
        _log.exception("%s: its arbiter raised on query", name)
        reason = f"its arbiter raised {type(error).__name__}: {error}"
    return BehaviorReport(name, 0, BehaviorState.UNKNOWN, reason=reason)
