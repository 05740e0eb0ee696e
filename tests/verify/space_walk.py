"""Engine runs whose vehicles move among shared spaces, with the reservations of an executive.

The vehicles have positions: numbers choose how far along its way one is seen, and where it stops.
Who has a place in a shared space is decided by `m2pem.deconfliction.reservations`, as in an
executive.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from typing import Any

from m2pem.allocation.assignment import Request, assign
from m2pem.allocation.needs import ConsideredRole
from m2pem.api.arbiter import BehaviorId, BehaviorRequest
from m2pem.api.telemetry import GeoPosition, VehicleState
from m2pem.deconfliction.conflicts import Refusal
from m2pem.deconfliction.operational_volume import Volume
from m2pem.deconfliction.reservations import Reservations
from m2pem.engine import inputs as i
from m2pem.engine.elements.allocations import behavior_of
from m2pem.engine.state import AllocationRequest, BehaviorPhase, RunState, RunStatus
from m2pem.fleet.allocation import resources_of
from m2pem.fleet.behaviors import SHARED
from m2pem.fleet.fleet import Fleet
from m2pem.fleet.parameters import resolve
from m2pem.fleet.space import may_wait_for_space
from m2pem.geo.local_frame import EastNorth, LocalFrame
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.losses import UNAVAILABLE
from m2pem.mission.mission import Mission
from m2pem.verify.net.petri_net import PetriNet
from tests.verify.allocator import Allocator
from tests.verify.models import Walk
from tests.verify.trace_mapping import Follower, Look


@dataclass(frozen=True)
class Seen:
    """What happens beside the inputs of the engine: a vehicle is seen farther along its way."""

    behavior: str


class SpaceFollower(Follower):
    """Follows the net by which tasks ask, and how many vehicles are in each shared space, too."""

    def __init__(self, net: PetriNet) -> None:
        self.asking: Counter[str] = Counter()
        self.inside: Counter[str] = Counter()
        super().__init__(net)

    def agrees(self, number: int, state: RunState, look: Look) -> bool:
        """A run that is over has no vehicles."""
        if not super().agrees(number, state, look):
            return False
        if state.status is RunStatus.ENDED:
            return True
        asking: Counter[str] = Counter()
        inside: Counter[str] = Counter()
        for place, count in self.encoding.marking(number).tokens.items():
            each = self.net.places[place]
            if each.space:
                inside[each.space] += count
            elif each.name.endswith(":asks"):
                asking[each.element] += count
        followed = {each.space for each in self.net.places}
        wanted = Counter({n: count for n, count in self.inside.items() if n in followed})
        return asking == self.asking and inside == wanted


class SpaceWalk(Walk):
    """A run of the engine, whose behaviors and requests have their space, followed by the net."""

    def __init__(
        self,
        mission: Mission,
        fleet: Fleet,
        net: PetriNet,
        seed: int,
        elsewhere: Sequence[EastNorth],
    ) -> None:
        """`elsewhere`: where vehicles may be that go anywhere, or whose home is not known; the
        first is in no shared space."""
        super().__init__(mission, fleet, net, seed)
        self.follower: SpaceFollower = SpaceFollower(net)
        self.elsewhere = elsewhere
        self.frame = LocalFrame(fleet.origin)
        self.reservations = Reservations(fleet)
        self.roles = Roles(fleet, Random(seed))
        self.at: dict[str, EastNorth] = {}
        self.volumes: dict[str, Mapping[ResourceId, Volume]] = {}
        self.given_space: dict[str, Mapping[ResourceId, Volume]] = {}
        self.progress: dict[str, float] = {}
        self.rejected: list[str] = []
        self.waits = 0
        self.refusals = 0
        for vehicle in fleet.vehicles.values():
            home = vehicle.settings.get("home")
            self.place(vehicle.id, elsewhere[0] if home is None else self.frame.to_local(home))
        self.homes = dict(self.at)

    def place(self, vehicle: str, at: EastNorth) -> None:
        """A vehicle is seen there."""
        self.at[vehicle] = at
        here = GeoPosition(*self.frame.to_latlon(at), 60.0)
        still = (0.0, 0.0, 0.0)
        self.reservations.received(
            VehicleState(
                ResourceId(vehicle), self.now_us, here, 0.0, velocity_enu_m_s=still, armed=False
            )
        )

    # --- as the executive does --------------------------------------------------------------------

    def give(self, item: Any) -> bool:
        if isinstance(item, Seen):
            self._go_on(item.behavior)
        else:
            if isinstance(item, i.BehaviorReported) and item.state.terminal:
                self._stop(item.behavior, item.state is BehaviorState.SUCCEEDED)
            self._receive(item)
        for _ in range(100):
            self._settle()
            if self.run.wants_continue or (answer := self._answer()) is None:
                break
            self._receive(answer)
        if not (self.run.wants_continue or self._follow()):
            return False
        while self.rejected:
            behavior = self.run.state.behaviors.get(self.rejected.pop())
            if behavior is not None and not self.give(
                i.BehaviorReported(
                    behavior.id, behavior.number + 1, BehaviorState.REJECTED, "REJECTED"
                )
            ):
                return False
        return True

    def _follow(self) -> bool:
        asking = [each.token.node.id for each in self.run.state.allocations.values()]
        self.follower.asking = Counter(asking)
        places = self.reservations.places(self.now_us)
        self.follower.inside = Counter({s.name: len(holders) for s, holders in places if holders})
        return self.follower.step(self.run.state)

    def things(self) -> list[Any]:
        found = [
            each for each in super().things() if getattr(each, "behavior", "") not in self.rejected
        ]
        moving = [
            Seen(b) for b, volumes in self.volumes.items() if any(map(_way, volumes.values()))
        ]
        return [*found, *moving, *moving]

    def _settle(self) -> None:
        """Reserve what has begun, release what has ended, and end what is cancelled."""
        state = self.run.state
        for behavior in list(self.volumes):
            if behavior not in state.behaviors:
                self._stop(behavior, well=False)
        for each in list(state.behaviors.values()):
            if each.phase is BehaviorPhase.CANCELLING:
                self._stop(each.id, well=False)
                report = i.BehaviorReported(each.id, each.number + 1, BehaviorState.CANCELLED)
                self._receive(report)
            elif each.id not in self.volumes:
                self._begin(each)

    def _begin(self, behavior: Any) -> None:
        request = next((r for r in self.given_space if r not in self.run.state.allocations), None)
        self.progress[behavior.id] = 0.0
        if request is not None and self.given_space[request] is not None:
            self.volumes[behavior.id] = self.given_space.pop(request)
            self.reservations.hand_on(BehaviorId(request), BehaviorId(behavior.id))
            return
        wanted = self._wanted(
            behavior.id,
            behavior.name,
            BehaviorType(behavior.type),
            behavior.parameters,
            behavior.resources,
        )
        self.volumes[behavior.id] = {}
        proposed = self.reservations.propose(wanted, BehaviorType(behavior.type), self.now_us)
        if proposed is None:
            return
        if self.reservations.refusal(proposed, self.now_us) is not None:
            self.rejected.append(behavior.id)
            self.refusals += 1
            return
        self.reservations.commit(proposed)
        self.volumes[behavior.id] = proposed.volumes or {}

    def _wanted(
        self,
        number: str,
        name: str,
        kind: BehaviorType,
        parameters: Mapping[str, Any],
        resources: Sequence[str],
    ) -> BehaviorRequest:
        fleet = self.fleet
        spec = SHARED[name, kind]
        values = resolve(spec, parameters, fleet.geometries.get, fleet.vehicles, fleet.origin)
        ids = tuple(map(ResourceId, resources))
        return BehaviorRequest(BehaviorId(number), 0, name, values, ids)

    def _go_on(self, behavior: str) -> None:
        self.progress[behavior] += (1 - self.progress[behavior]) * self.dice.random()
        for vehicle, volume in self.volumes[behavior].items():
            if way := _way(volume):
                self.place(vehicle, _along(way, self.progress[behavior]))

    def _stop(self, behavior: str, well: bool) -> None:
        if behavior not in self.volumes:
            return
        volumes = self.volumes.pop(behavior)
        known = self.run.state.behaviors.get(behavior)
        for vehicle, volume in volumes.items():
            way = _way(volume)
            if well and known is not None and known.name == "return_to_launch":
                self.place(vehicle, self.homes[vehicle])
            elif well and way:
                self.place(vehicle, way[-1])
            elif well and known is not None and known.name == "area_survey":
                self.place(vehicle, _middle(volume))
            elif way:
                part = self.progress[behavior] + (1 - self.progress[behavior]) * self.dice.random()
                self.place(vehicle, _along(way, part))
            elif len(volume.pieces) > 1:  # with one, it stays
                self.place(vehicle, self._somewhere_in(volume))
        self.reservations.release(BehaviorId(behavior))

    def _somewhere_in(self, volume: Volume) -> EastNorth:
        area = self.dice.choice(volume.pieces).area
        if area is None:
            return self.dice.choice(self.elsewhere)
        parts = [self.dice.random() for _ in area]
        return (
            sum(east * part for (east, _), part in zip(area, parts, strict=True)) / sum(parts),
            sum(north * part for (_, north), part in zip(area, parts, strict=True)) / sum(parts),
        )

    # --- requests ---------------------------------------------------------------------------------

    def _answer(self) -> i.Input | None:
        requests = [*self.run.state.allocations.values()]
        self.dice.shuffle(requests)
        for request in requests:
            answer = self._answer_to(request)
            if answer is not None:
                return answer
        return None

    def _answer_to(self, request: AllocationRequest) -> i.Input | None:
        behavior = behavior_of(request)
        roles = self.roles.roles_of(self.run.state, request)
        options = [each.options for each in roles]
        refusals: list[Refusal] = []
        while chosen := assign([Request(request.id, tuple(options))], self.roles.order):
            filled = self.roles.filled(roles, chosen[request.id])
            resources = [one for ids in filled.values() for one in ids]
            refusal = self._without_space(request, behavior, resources)
            if refusal is None:
                return i.ResourcesChosen(request.id, dict(filled), {})
            refusals.append(refusal)
            options = [
                replace(
                    each, costs_s={r: c for r, c in each.costs_s.items() if r != refusal.vehicle}
                )
                for each in options
            ]
        if not refusals:
            if any(each.role.need is not None and each.role.need.waits for each in roles):
                return None
            return i.ResourcesNotFree(request.id, "too few are free", {}, UNAVAILABLE)
        waits = next((each for each in refusals if each.wait_s is not None), None)
        if waits is None:
            self.refusals += 1
            return i.ResourcesNotFree(request.id, refusals[0].reason, {}, "REJECTED")
        if request.reason == waits.reason:
            return None
        self.waits += 1
        return i.ResourcesNotFree(request.id, waits.reason, {}, wait_s=waits.wait_s)

    def _without_space(
        self, request: AllocationRequest, behavior: Any, resources: Sequence[str]
    ) -> Refusal | None:
        if not may_wait_for_space(self.fleet, behavior.type, behavior.name, resources):
            return None
        wanted = self._wanted(
            request.id, behavior.name, behavior.type, request.parameters, resources
        )
        proposed = self.reservations.propose(wanted, behavior.type, self.now_us)
        if proposed is None:
            return None
        refusal = self.reservations.refusal(proposed, self.now_us)
        if refusal is None:
            self.reservations.commit(proposed)
            self.given_space[request.id] = proposed.volumes or {}
        return refusal


class Roles(Allocator):
    """What may fill the roles of a request, at costs that dice say."""

    def filled(
        self, roles: Sequence[ConsideredRole], chosen: Mapping[str, tuple[ResourceId, ...]]
    ) -> dict[str, tuple[ResourceId, ...]]:
        return {
            each.role.name: resources_of(each.role, self.fleet)
            if each.role.resource
            else chosen[each.role.name]
            for each in roles
            if each.role.name in chosen
        }


def _way(volume: Volume) -> tuple[EastNorth, ...]:
    return volume.route if len(volume.route) > 1 else ()


def _along(way: Sequence[EastNorth], part: float) -> EastNorth:
    """A place on a polyline, by the part of its length."""
    left = part * sum(math.dist(a, b) for a, b in pairwise(way))
    for a, b in pairwise(way):
        length = math.dist(a, b)
        if left <= length and length:
            return a[0] + (b[0] - a[0]) * left / length, a[1] + (b[1] - a[1]) * left / length
        left -= length
    return way[-1]


def _middle(volume: Volume) -> EastNorth:
    corners = [corner for piece in volume.pieces[1:] for corner in piece.area or ()][1:]
    return (
        sum(east for east, _ in corners) / len(corners),
        sum(north for _, north in corners) / len(corners),
    )
