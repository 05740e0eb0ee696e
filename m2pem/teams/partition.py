"""Which member carries out which share of a plan: its own, or a piece of a lost member's."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from m2pem.api.remaining import RemainingWork, raw_parameters
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.geo.polyline import EastNorthUp
from m2pem.mission.catalogue import ResourceId
from m2pem.mission.geometry import Route
from m2pem.mission.values import Value
from m2pem.teams.division import Taker, divide, from_nearer_end, read_parameters, work_of
from m2pem.teams.member import Member
from m2pem.teams.plan import Leg, Plan
from m2pem.teams.restart import Reference, Transfer

_OF = "~"
"""Between a lost member and the number of a piece of its share, in the names of parts."""


@dataclass(slots=True)
class Share:
    """A planned part of one member, or a piece of a lost member's. `by`: the member that carries
    it out; None: it has not begun. `part`: the id of the part. `left`: the parameters of what is
    left of it, as last reported. `given_up`: no member does it, or others do it in pieces.
    `begins`: how many times it has begun again."""

    leg: Leg
    by: ResourceId | None = None
    part: str = ""
    done: bool = False
    given_up: bool = False
    left: Mapping[str, Value] | None = None
    begins: int = 0

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
    """The shares of a plan: by the member to which the plan gave each, and pieces of the shares of
    lost members, by that member and a number.

    `again`: parts get new ids, because arbiters may know the old ones as ended.
    """

    def __init__(self, plan: Plan, frame: LocalFrame) -> None:
        self.again = False
        self._plan = plan
        self._frame = frame
        self._shares = {str(leg.member): Share(leg) for leg in plan.legs}

    @property
    def all_over(self) -> bool:
        return all(share.over for share in self._shares.values())

    @property
    def arrived(self) -> Sequence[ResourceId]:
        """Members whose own share is done."""
        return [share.leg.member for key, share in self._shares.items() if share.done and _own(key)]

    def noted(self, reference: Reference) -> Reference:
        """Return a reference with what the journal keeps of the shares."""
        shares = self._shares.items()
        return replace(
            reference,
            done=tuple(each.part for each in self._shares.values() if each.done and each.part),
            split=self._plan.split,
            transfers={
                key: Transfer(
                    share.leg.member, share.leg.behavior, raw_parameters(share.leg.parameters)
                )
                for key, share in shares
                if not _own(key)
            },
            given_up=tuple(key for key, each in shares if each.given_up and self._plan.shared),
            left={
                key: share.left
                for key, share in shares
                if share.left is not None and not share.over
            },
        )

    def note_left(self, part: str, left: Mapping[str, Value]) -> bool:
        """Note what is left of a part. Return whether the journal must have it."""
        share = next((each for each in self._shares.values() if each.part == part), None)
        if share is None or share.over or share.left == left:
            return False
        share.left = left
        return self._plan.shared

    def finish(self, part: str) -> None:
        for share in self._shares.values():
            if share.part == part:
                share.done = True

    def withdraw(self, member: ResourceId) -> None:
        """Let the share that a member carries out begin again, when what it does has ended."""
        for share in self._shares.values():
            if share.by == member and not share.over:
                share.by, share.part, share.begins = None, "", share.begins + 1

    def renew(self, member: ResourceId, places: Sequence[EastNorthUp]) -> None:
        """Let a member's own share be a route through other places."""
        share = self._shares[str(member)]
        given = {k: v for k, v in share.leg.parameters.items() if k not in ("target", "heading")}
        route = given.get("route")
        high = isinstance(route, Route) and all(each[2] is not None for each in route.waypoints)
        waypoints = tuple(
            (*self._frame.to_latlon(place[:2]), place[2] if high else None) for place in places
        )
        frame = route.altitude_frame if isinstance(route, Route) else None
        given["route"] = Route(waypoints, frame) if frame else Route(waypoints)
        share.leg = Leg(member, "single_vehicle_routing", given)

    def carries(self, part: str) -> bool:
        """Whether a part is that of a share, and not of one that begins again."""
        return any(share.part == part for share in self._shares.values())

    def place(self, part: str, *, done: bool) -> ResourceId:
        """Assign a part that an arbiter knows after a restart; return its member."""
        doer, _, rest = part.partition("/")
        share = self._shares.get(rest.partition("/")[0] or doer)
        if share is not None:
            share.by, share.part, share.done = ResourceId(doer), part, done
            share.begins = sum(map(int, filter(str.isdigit, rest.split("/"))))
        return ResourceId(doer)

    def restore(self, kept: Reference) -> None:
        """After a restart: take up the pieces of before, and what was left of each share."""
        for key, transfer in kept.transfers.items():
            parameters = read_parameters(transfer.behavior, transfer.parameters)
            if parameters is not None:
                self._shares[key] = Share(Leg(transfer.member, transfer.behavior, parameters))
        for member in kept.lost:
            share = self._shares.get(str(member))
            if share is not None and not self._plan.shared:
                share.given_up = True
        for key in kept.given_up:
            if key in self._shares:
                self._shares[key].given_up = True
        for key, left in kept.left.items():
            if key in self._shares:
                self._shares[key].left = left

    def begin_with_what_is_left(self) -> None:
        """Shares that begin again, after a restart, need only what was left of them."""
        for share in self._shares.values():
            if share.by is None and not share.over:
                share.leg = self._rest(share)

    def drop(
        self,
        member: ResourceId,
        members: Mapping[ResourceId, Member],
        place_of: Callable[[ResourceId], EastNorth | None],
    ) -> None:
        """Divide the unfinished shares of a lost member among the others, or give them up."""
        lost = [
            (key, share)
            for key, share in self._shares.items()
            if (share.by or share.leg.member) == member and not share.over
        ]
        others = [each for each in members.values() if not each.lost and each.id != member]
        for _, share in lost:
            share.given_up = True
        if not self._plan.shared or not others:
            return
        takers = [self._taker(each, place_of(each.id)) for each in others]
        rests = [(key, self._rest(share)) for key, share in lost]
        ways = [
            (key, leg, work_of(leg.behavior, leg.parameters, self._frame)) for key, leg in rests
        ]
        pieces = divide([way for _, _, way in ways if way is not None], takers)
        number = 0
        for key, leg, way in ways:
            if way is None:
                self._give(min(takers, key=lambda taker: taker.free_s).member, key, leg)
                continue
            mine = [piece for piece in pieces if piece.work == number]
            number += 1
            parts = [way.part(piece.from_m, piece.to_m) for piece in mine] if mine[1:] else [None]
            if None in parts:  # a single piece, or one that no parameters can say
                self._give(mine[0].member, key, self._nearer(leg, mine[0].member, takers))
                continue
            for piece, raw in zip(mine, parts, strict=True):
                parameters = read_parameters(leg.behavior, raw or {}) or leg.parameters
                cut = replace(leg, parameters=parameters)
                self._give(piece.member, key, self._nearer(cut, piece.member, takers))

    def _nearer(self, leg: Leg, member: ResourceId, takers: Sequence[Taker]) -> Leg:
        place = next(taker.place for taker in takers if taker.member == member)
        parameters = from_nearer_end(leg.behavior, leg.parameters, self._frame, place)
        return replace(leg, parameters=parameters)

    def _give(self, taker: ResourceId, key: str, leg: Leg) -> None:
        origin = key.partition(_OF)[0]
        number = sum(other.startswith(f"{origin}{_OF}") for other in self._shares) + 1
        takes = self._plan.takes.get(taker, frozenset())
        kept = {name: value for name, value in leg.parameters.items() if name in takes}
        self._shares[f"{origin}{_OF}{number}"] = Share(Leg(taker, leg.behavior, kept))

    def _rest(self, share: Share) -> Leg:
        """Return what is left of a share."""
        if share.left is None:
            return replace(share.leg, after=None)
        parameters = read_parameters(share.leg.behavior, share.left)
        return replace(share.leg, parameters=parameters or share.leg.parameters, after=None)

    def _taker(self, member: Member, place: EastNorth | None) -> Taker:
        """Return when and where a member will have done all that it has."""
        speed_m_s = self._plan.speeds_m_s.get(member.id, 1.0)
        free_s = 0.0
        for share in self._shares.values():
            if (share.by or share.leg.member) != member.id or share.over:
                continue
            leg = self._rest(share)
            work: RemainingWork | None = work_of(leg.behavior, leg.parameters, self._frame)
            if work is not None:
                free_s += work.line.length_m / speed_m_s
                place = work.line.points[-1]
        return Taker(member.id, free_s, place, speed_m_s)

    def assignments(self, members: Mapping[ResourceId, Member], epoch: int) -> Iterator[Assignment]:
        """Yield the shares that can begin now, and mark each as begun."""
        for key, share in self._shares.items():
            doer = members[share.leg.member]
            if share.over or share.by is not None or doer.lost or doer.active:
                continue
            before = self._shares.get(str(share.leg.after)) if share.leg.after else None
            own = _own(key)
            if (before is not None and not before.over) or not (own or self._has_done(doer.id)):
                continue
            restarts = [str(each) for each in (epoch if self.again else 0, share.begins) if each]
            part = doer.id if own and not restarts else "/".join((doer.id, key, *restarts))
            share.by, share.part = doer.id, part
            yield Assignment(doer, share.leg, share.part, own and not share.begins)

    def _has_done(self, member: ResourceId) -> bool:
        own = self._shares.get(str(member))
        return own is None or own.over


def _own(key: str) -> bool:
    return _OF not in key
