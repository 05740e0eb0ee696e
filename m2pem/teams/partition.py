"""Which member carries out which share of a plan: its own, or that of a lost member."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.mission.catalogue import ResourceId
from m2pem.teams.member import Member
from m2pem.teams.plan import Leg, Plan


@dataclass(slots=True)
class Share:
    """The planned part of one member. `by`: the member that carries it out; None: no member yet.
    `part`: the id of the part."""

    leg: Leg
    by: ResourceId | None = None
    part: str = ""
    done: bool = False
    given_up: bool = False

    @property
    def over(self) -> bool:
        """Whether it is done or given up."""
        return self.done or self.given_up


@dataclass(frozen=True, slots=True)
class Assignment:
    """A share that a member can begin now. `own`: it is the share that the plan gave the member."""

    member: Member
    leg: Leg
    part: str
    own: bool


class Partition:
    """The shares of a plan, by the member to which the plan gave each.

    `again`: parts get new ids, because arbiters may know the old ones as ended.
    """

    def __init__(self, plan: Plan) -> None:
        self.again = False
        self._plan = plan
        self._shares = {leg.member: Share(leg) for leg in plan.legs}

    @property
    def all_over(self) -> bool:
        """Whether all shares are done or given up."""
        return all(share.over for share in self._shares.values())

    @property
    def arrived(self) -> Sequence[ResourceId]:
        """Members whose own share is done."""
        return [origin for origin, share in self._shares.items() if share.done]

    @property
    def done(self) -> tuple[str, ...]:
        """The parts that have succeeded."""
        return tuple(each.part for each in self._shares.values() if each.done and each.part)

    def finish(self, part: str) -> None:
        """Mark a part as succeeded."""
        for share in self._shares.values():
            if share.part == part:
                share.done = True

    def place(self, part: str, *, done: bool) -> ResourceId:
        """Assign a part that an arbiter knows after a restart; return its member."""
        doer, _, rest = part.partition("/")
        share = self._shares.get(ResourceId(rest.partition("/")[0] or doer))
        if share is not None:
            share.by, share.part, share.done = ResourceId(doer), part, done
        return ResourceId(doer)

    def drop(self, member: ResourceId) -> None:
        """Leave the unfinished shares of a lost member to the others, or give them up."""
        for share in self._shares.values():
            if (share.by or share.leg.member) == member and not share.over:
                share.by, share.part = None, ""
                share.given_up = not self._plan.shared

    def assignments(self, members: Mapping[ResourceId, Member], epoch: int) -> Iterator[Assignment]:
        """Yield the shares that can begin now, and mark each as begun."""
        for origin, share in self._shares.items():
            if share.over or share.by is not None:
                continue
            taker = self._taker(origin, share, members)
            if taker is None:
                continue
            own = taker.id == origin
            part = f"{taker.id}/{origin}/{epoch}" if self.again else taker.id
            if not own and not self.again:
                part = f"{taker.id}/{origin}"
            share.by, share.part = taker.id, part
            yield Assignment(
                taker, share.leg if own else self._fitted(share.leg, taker.id), part, own
            )

    def _taker(
        self, origin: ResourceId, share: Share, members: Mapping[ResourceId, Member]
    ) -> Member | None:
        """Return the member that begins a share now; None: no member can yet."""
        before = self._shares.get(share.leg.after) if share.leg.after is not None else None
        if before is not None and not before.over:
            return None
        if not members[origin].lost:
            return members[origin]
        free = (
            each
            for each in members.values()
            if not each.lost and not each.active and self._has_done_its_own(each.id)
        )
        return next(free, None)

    def _has_done_its_own(self, member: ResourceId) -> bool:
        own = self._shares.get(member)
        return own is None or own.over

    def _fitted(self, leg: Leg, taker: ResourceId) -> Leg:
        takes = self._plan.takes.get(taker, frozenset())
        kept = {name: value for name, value in leg.parameters.items() if name in takes}
        return replace(leg, member=taker, parameters=kept)
