"""What a lost member has not surveyed is surveyed once, and all the others end at the same time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from bench.coverage import Coverage, Sample
from m2pem.api.remaining import RemainingWork
from m2pem.fleet.fleet import Domain, Fleet, LostMemberPolicy
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.catalogue import BehaviorSpec, BehaviorState, ResourceId
from m2pem.mission.geometry import Area, Route
from m2pem.simulation.arbiters import SimArbiter
from m2pem.teams.division import CORNER_S, Taker, divide, work_of
from m2pem.teams.partition import Partition
from m2pem.teams.plan import Leg, Plan
from m2pem.teams.restart import Reference, read_reference

from .carts import FRAME
from .conftest import area, one_task
from .rehearsed import Rehearsed, rehearsed, sim_fleet

EAST_M, NORTH_M, WIDTH_M = 200.0, 175.5, 19.5
GEOMETRIES = {"field": area((0, 0), (EAST_M, 0), (EAST_M, NORTH_M), (0, NORTH_M))}
PLACES = {"a": (-20.0, 0.0), "b": (-20.0, 60.0), "c": (-20.0, 120.0)}
SURVEY = one_task("area_survey", area="field", spacing="20 m", speed="5 m/s", overshoot="4 m")


class OnRoutes(SimArbiter):
    """Offers no `area_survey` of its own: each member flies its passes as a route."""

    def catalogue(self, resource: ResourceId) -> Sequence[BehaviorSpec]:
        return [spec for spec in super().catalogue(resource) if spec.name != "area_survey"]


def fleet() -> Fleet:
    return sim_fleet(
        PLACES,
        GEOMETRIES,
        policy=LostMemberPolicy.CONTINUE,
        domains=dict.fromkeys(PLACES, Domain.AIR),
        settings={name: {"altitude": "30 m"} for name in PLACES},
    )


KINDS = pytest.mark.parametrize("kind", [SimArbiter, OnRoutes])


@dataclass
class Tracks:
    """Where the members were. `ends_s`: when each was seen to move last."""

    of: dict[str, list[Sample]] = field(default_factory=dict)
    ends_s: dict[str, float] = field(default_factory=dict)

    def look(self, world: Rehearsed, names: Sequence[str]) -> None:
        for name in names:
            state = world.sim.sight(ResourceId(name))
            if state is None or state.position is None:
                continue
            now_s = world.clock.now_us() / 1e6
            track = self.of.setdefault(name, [])
            place = FRAME.to_local(state.position.latlon)
            if track and math.dist(track[-1][1:], place) > 0.01:
                self.ends_s[name] = now_s
            track.append((now_s, *place))

    @property
    def coverage(self) -> Coverage:
        coverage = Coverage(EAST_M, NORTH_M, WIDTH_M)
        for track in self.of.values():
            coverage.add(track)
        return coverage


async def surveyed(world: Rehearsed, losses: dict[str, float], tracks: Tracks) -> Any:
    """Start the survey, and cut the links of members so many seconds later."""
    await world.executive.control.start(SURVEY)
    begun_s = world.clock.now_us() / 1e6
    heard = set(PLACES)

    def look() -> None:
        tracks.look(world, sorted(heard))
        for name, at_s in losses.items():
            if name in heard and world.clock.now_us() / 1e6 - begun_s >= at_s:
                heard.discard(name)
                world.sim.lose_link(ResourceId(name))

    await world.until_ended(look)
    return world.ended()[0]


@KINDS
def test_all_is_surveyed_once_and_the_others_end_together(kind: type[SimArbiter]) -> None:
    tracks = Tracks()

    async def story(world: Rehearsed) -> Any:
        return await surveyed(world, {"b": 60.0}, tracks)

    ended = rehearsed(fleet(), story, kind=kind)
    assert ended.state is BehaviorState.SUCCEEDED
    assert ended.reason.startswith("without b (LINK_LOST")
    coverage = tracks.coverage
    assert coverage.covered > 0.98
    assert coverage.twice < 0.05
    assert abs(tracks.ends_s["a"] - tracks.ends_s["c"]) < 1.5 * CORNER_S  # cut at a corner


@KINDS
def test_a_member_that_is_lost_with_what_it_took_over_is_replaced_as_well(
    kind: type[SimArbiter],
) -> None:
    tracks = Tracks()

    async def story(world: Rehearsed) -> Any:
        return await surveyed(world, {"b": 50.0, "c": 190.0}, tracks)

    ended = rehearsed(fleet(), story, kind=kind)
    assert ended.state is BehaviorState.SUCCEEDED
    assert tracks.ends_s["c"] < tracks.ends_s["a"]
    assert tracks.coverage.covered > 0.98
    assert tracks.coverage.twice < 0.06


def way(*places: tuple[float, float]) -> RemainingWork:
    frame = LocalFrame((38.0, -77.0))
    route = Route(tuple((*frame.to_latlon(place), None) for place in places))
    work = work_of("single_vehicle_routing", {"route": route}, frame)
    assert work is not None
    return work


def test_who_is_faster_or_free_earlier_takes_more() -> None:
    takers = [
        Taker(ResourceId("slow"), 0.0, (0.0, 0.0), 1.0),
        Taker(ResourceId("fast"), 0.0, (0.0, 0.0), 3.0),
        Taker(ResourceId("busy"), 1000.0, (0.0, 0.0), 3.0),
    ]
    pieces = {piece.member: piece for piece in divide([way((0, 0), (400, 0))], takers)}
    assert pieces.keys() == {"slow", "fast"}
    assert pieces["slow"].from_m == 0.0, "it is there at once"
    ends = [
        pieces["slow"].to_m / 1.0,
        pieces["fast"].to_m / 3.0,
    ]
    assert ends[0] == pytest.approx(ends[1], rel=0.05)


def test_each_takes_what_is_nearer() -> None:
    takers = [
        Taker(ResourceId("east"), 10.0, (500.0, 0.0), 5.0),
        Taker(ResourceId("west"), 10.0, (0.0, 0.0), 5.0),
    ]
    first, second = divide([way((0, 0), (400, 0))], takers)
    assert (first.member, second.member) == ("west", "east")
    assert first.to_m == second.from_m


def test_several_ways_are_taken_whole_where_that_is_even() -> None:
    takers = [Taker(ResourceId(name), 0.0, None, 5.0) for name in "ab"]
    pieces = divide([way((0, 0), (200, 0)), way((0, 50), (200, 50))], takers)
    assert [(piece.work, piece.from_m) for piece in pieces] == [(0, 0.0), (1, 0.0)]
    assert all(piece.to_m == pytest.approx(200.0, abs=1e-3) for piece in pieces)


@pytest.mark.parametrize(("north_m", "cut_m"), [(210.0, 200.0), (190.0, 200.0), (270.0, 235.0)])
def test_no_member_turns_for_a_bit_beyond_a_corner(north_m: float, cut_m: float) -> None:
    takers = [Taker(ResourceId(name), 0.0, None, 5.0) for name in "ab"]
    first, second = divide([way((0, 0), (200, 0), (200, north_m))], takers)
    assert first.to_m == second.from_m == pytest.approx(cut_m, abs=0.1)


def test_nothing_is_divided_where_nothing_is_left() -> None:
    assert divide([], [Taker(ResourceId("a"), 0.0, None, 5.0)]) == []


def test_pieces_of_areas_are_the_same_after_the_journal() -> None:
    """As after a restart: what the journal has gives the same parts to the same members."""
    corners = [(0.0, 0.0), (200.0, 0.0), (200.0, 60.0), (0.0, 60.0), (0.0, 0.0)]
    field_ = Area((tuple((*FRAME.to_latlon(corner), None) for corner in corners),))
    given = {"area": field_, "heading": math.pi / 2, "spacing": 21.0, "speed": 5.0}
    names = [ResourceId(name) for name in "abc"]
    legs = tuple(Leg(name, "area_survey", given) for name in names)
    plan = Plan(
        legs,
        shared=True,
        takes=dict.fromkeys(names, frozenset(given)),
        speeds_m_s=dict.fromkeys(names, 5.0),
    )
    crew: Any = {name: SimpleNamespace(id=name, lost="", active=True) for name in names}
    before = Partition(plan, FRAME)
    before.place("b", done=False)
    half = work_of("area_survey", given, FRAME)
    assert half is not None
    left = half.part(half.line.length_m * 0.4)
    assert left is not None
    assert before.note_left("b", left)
    crew[names[1]].lost = "LINK_LOST"
    before.drop(names[1], crew, lambda _: None)
    kept = before.noted(Reference(lost={names[1]: "LINK_LOST"}))
    assert sorted(each.member for each in kept.transfers.values()) == ["a", "c"]
    after = Partition(plan, FRAME)
    after.restore(read_reference(kept.text()))
    after.drop(names[1], crew, lambda _: None)
    again = after.noted(Reference())
    assert again.transfers == kept.transfers
    assert again.given_up == ("b",)
    for name in "ac":
        after.place(name, done=True)
        crew[ResourceId(name)].active = False
    begun = {each.part: each.leg.parameters for each in after.assignments(crew, 1)}
    assert begun.keys() == {f"{each.member}/{key}" for key, each in kept.transfers.items()}
    passes_m = 0.0
    for parameters in begun.values():
        piece = work_of("area_survey", parameters, FRAME)
        assert piece is not None
        segments = piece.line.segments[::2]
        passes_m += math.fsum(segment.length_m for segment in segments)
    assert passes_m == pytest.approx(3 * 200.0 * 0.6, rel=0.05)
