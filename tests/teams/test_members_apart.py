"""No two members of a team come nearer to each other than their spacing less a fifth, unless the
team says so before: on random routes with turns of any angle, judged by where the vehicles are."""

import math
from dataclasses import dataclass, field, replace
from itertools import combinations
from random import Random

import pytest
import shapely

from m2pem.api.clock import SystemClock
from m2pem.bpmn import parse_mission
from m2pem.engine.records import BehaviorEnded
from m2pem.executive.fleet_connections import FleetArbiters
from m2pem.executive.loading import findings_for
from m2pem.findings import Finding, Severity
from m2pem.fleet.fleet import Domain, Fleet, LostMemberPolicy, SharedSpace
from m2pem.mission.catalogue import BehaviorState, ResourceId
from m2pem.mission.geometry import Area
from m2pem.plugins import PluginManager
from m2pem.simulation.faults import Fault
from m2pem.testing.contracts.arbiter_harness import context
from tests.seeds import named

from .carts import FRAME
from .conftest import area, one_task, route
from .rehearsed import Rehearsed, rehearsed, sim_fleet

NAMES = "abcde"
SHAPES = ("column", "line", "wedge", "vee", "echelon_left", "echelon_right", "diamond")
SLOTS = {
    "line": [(0, 0), (0, 1), (0, -1), (0, 2), (0, -2)],
    "wedge": [(0, 0), (1, 1), (1, -1), (2, 2), (2, -2)],
    "vee": [(0, 0), (-1, 1), (-1, -1), (-2, 2), (-2, -2)],
    "echelon_left": [(k, k) for k in range(5)],
    "echelon_right": [(k, -k) for k in range(5)],
    "diamond": [(0, 0), (1, 1), (1, -1), (2, 0), (3, 0)],
    "column": [(k, 0) for k in range(5)],
}


@dataclass
class Case:
    """A team, its spacing in metres, and its route as places in metres."""

    names: str
    shape: str
    spacing_m: float
    places: list[tuple[float, float]]
    domain: Domain
    behavior: str = "road_following_formation"
    speeds_m_s: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, seed: int) -> "Case":
        """A random one: legs short and long, turns from 0 to 180 degrees."""
        random = Random(seed)
        spacing_m = random.uniform(5, 40)
        places, yaw = [(0.0, 0.0)], 0.0
        for _ in range(random.randint(1, 5)):
            length_m = random.choice([random.uniform(0.3, 2), random.uniform(2, 12)]) * spacing_m
            east, north = places[-1]
            places.append((east + length_m * math.cos(yaw), north + length_m * math.sin(yaw)))
            yaw += random.choice([-1, 1]) * random.choice(
                [random.uniform(0, math.pi), random.uniform(2, math.pi), math.pi / 2]
            )
        shape = random.choice(["column", *SHAPES])
        count = random.randint(2, 5)
        speeds = [random.choice([15.0, random.uniform(1.5, 15)]) for _ in range(count)]
        behavior = "bridge_crossing" if shape == "column" and random.random() < 0.2 else ""
        return cls(
            NAMES[:count],
            shape,
            spacing_m,
            places,
            random.choice([Domain.GROUND, Domain.GROUND, Domain.AIR, Domain.SURFACE]),
            behavior or random.choice(["formation", "road_following_formation"]),
            speeds,
        )

    def fleet(self, policy: LostMemberPolicy = LostMemberPolicy.STOP) -> Fleet:
        """The members in their places behind the beginning of the route."""
        slots = dict(zip(self.names, SLOTS[self.shape], strict=False))
        first = min(back for back, _ in slots.values())
        starts = {
            name: ((first - back - 0.5) * self.spacing_m, left * self.spacing_m)
            for name, (back, left) in slots.items()
        }
        speeds = self.speeds_m_s or [15.0] * len(self.names)
        aloft = {"altitude": "30 m"} if self.domain is Domain.AIR else {}
        return sim_fleet(
            starts,
            {"way": route(*self.places)},
            policy=policy,
            domains=dict.fromkeys(self.names, self.domain),
            settings={
                name: {"max_speed": f"{speed} m/s"} | aloft
                for name, speed in zip(self.names, speeds, strict=True)
            },
        )

    @property
    def mission(self) -> bytes:
        given = {} if self.behavior == "bridge_crossing" else {"shape": self.shape}
        return one_task(self.behavior, route="way", spacing=f"{self.spacing_m} m", **given)


@dataclass
class Judged:
    """`nearest_m`: by the two vehicles, whatever their links. `begun_m`: where they began."""

    ended: BehaviorEnded
    nearest_m: dict[tuple[str, str], float]
    begun_m: dict[tuple[str, str], float]
    when_s: dict[tuple[str, str], float]
    seconds: float
    least_m: float
    tracks: dict[str, list[tuple[float, float]]] = field(repr=False)


def places_of(world: Rehearsed) -> dict[str, tuple[float, float]]:
    now_us = world.clock.now_us()
    return {str(each.id): each.pose(now_us).place[:2] for each in world.sim.vehicles}


def judged(fleet: Fleet, mission: bytes, *faults: tuple[str, Fault]) -> Judged:
    """Rehearse it, and measure each 0.1 s."""

    async def story(world: Rehearsed) -> Judged:
        for victim, fault in faults:
            world.sim.inject(victim, fault)  # type: ignore[arg-type]
        start_us = world.clock.now_us()
        begun = {
            (a, b): math.dist(one, other)
            for (a, one), (b, other) in combinations(places_of(world).items(), 2)
        }
        nearest, when = dict(begun), dict.fromkeys(begun, 0.0)
        tracks: dict[str, list[tuple[float, float]]] = {name: [] for name in places_of(world)}
        await world.executive.control.start(mission)
        for _ in range(10 * 7200):
            places = places_of(world)
            for name, place in places.items():
                tracks[name].append(place)
            for (a, b), least_m in nearest.items():
                if (apart_m := math.dist(places[a], places[b])) < least_m:
                    nearest[a, b] = apart_m
                    when[a, b] = (world.clock.now_us() - start_us) / 1e6
            if world.ended():
                seconds = (world.clock.now_us() - start_us) / 1e6
                least_m = min(nearest.values())
                return Judged(world.ended()[0], nearest, begun, when, seconds, least_m, tracks)
            await world.clock.sleep(0.1)
        raise AssertionError(f"it had not ended in two hours; {places_of(world)}")

    found: Judged = rehearsed(fleet, story)
    return found


def refused(found: Judged) -> bool:
    """Whether the team has said that it cannot, before anybody moved."""
    if found.ended.code != "REJECTED":
        return False
    said = ("would come within", "in each other's ways")
    assert any(each in found.ended.reason for each in said), found.ended
    assert found.nearest_m == found.begun_m
    return True


def check(seed: int) -> None:
    case = Case.of(seed)
    with named(seed):
        found = judged(case.fleet(), case.mission)
        if not refused(found):
            assert found.ended.state is BehaviorState.SUCCEEDED, (case, found)
            assert found.least_m >= 0.8 * case.spacing_m, (case, found)


@pytest.mark.parametrize("seed", [0, 2, 12, 16, 18, 27, 34, 46, 51, 82, 107, 137, 210, 215, 268])
def test_members_keep_apart_on_any_route_or_say_before_that_they_cannot(seed: int) -> None:
    check(seed)


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 600, 25))
def test_members_keep_apart_on_six_hundred_routes(first: int) -> None:
    for seed in range(first, first + 25):
        check(seed)


def check_lost(seed: int) -> None:
    case, random = Case.of(seed), Random(seed * 7 + 1)
    victim, kind = random.choice(case.names), random.choice(["fail", "lose_link"])
    error = "ROUTE_BLOCKED" if kind == "fail" else ""
    fault = Fault(kind, after_s=random.uniform(2, 90), error=error)
    with named(seed):
        found = judged(case.fleet(LostMemberPolicy.CONTINUE), case.mission, (victim, fault))
        if refused(found):
            return
        assert found.least_m >= 0.8 * case.spacing_m, (case, victim, found)
        if found.ended.state is BehaviorState.FAILED:
            assert "cannot" in found.ended.reason or len(case.names) == 1, found.ended


@pytest.mark.parametrize("seed", [3, 16, 25, 34, 51, 60, 62, 82, 92])
def test_nobody_drives_over_a_lost_member(seed: int) -> None:
    check_lost(seed)


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 200, 25))
def test_nobody_drives_over_a_lost_member_on_two_hundred_routes(first: int) -> None:
    for seed in range(first, first + 25):
        check_lost(seed)


HAIRPIN = [(0.0, 0.0), (200.0, 0.0), (200.0, 4.0), (0.0, 4.0)]
OUT_AND_BACK = [(0.0, 0.0), (200.0, 0.0), (0.0, 0.5)]
SPUR = [(0.0, 0.0), (100.0, 0.0), (100.0, 80.0), (100.0, 0.0), (200.0, 0.0)]
SHARP = [(0.0, 0.0), (200.0, 0.0), (60.0, 80.0)]


def column(places: list[tuple[float, float]], count: int = 4) -> Case:
    return Case(NAMES[:count], "column", 20.0, places, Domain.GROUND)


@pytest.mark.parametrize("places", [HAIRPIN, OUT_AND_BACK])
def test_a_column_that_would_meet_itself_is_refused_with_the_corner(
    places: list[tuple[float, float]],
) -> None:
    case = column(places)
    found = judged(case.fleet(), case.mission)
    assert refused(found)
    latitude, longitude = map(float, found.ended.reason.split("[")[1].split("]")[0].split(", "))
    corner = FRAME.to_local((latitude, longitude))
    assert min(math.dist(corner, place) for place in places[1:-1]) < 0.2
    (finding,) = checked(case)
    assert (finding.rule, finding.severity) == ("members-meet", Severity.WARNING)
    assert found.ended.reason in finding.message
    assert finding.place is not None
    assert math.dist(FRAME.to_local(finding.place), corner) < 0.2


@pytest.mark.parametrize(("places", "within_m"), [(SHARP, 5.1), (SPUR, 0.0)])
def test_a_column_passes_a_sharp_turn_one_after_the_other_and_check_says_so(
    places: list[tuple[float, float]], within_m: float
) -> None:
    case = column(places)
    found = judged(case.fleet(), case.mission)
    assert found.ended.state is BehaviorState.SUCCEEDED
    assert found.least_m >= 16
    (finding,) = checked(case)
    assert finding.rule == "members-meet"
    assert f"would come within {within_m} m" in finding.message
    assert "one after the other" in finding.remedy
    assert finding.place is not None
    assert min(math.dist(FRAME.to_local(finding.place), each) for each in places[1:-1]) < 0.2


@pytest.mark.parametrize(
    ("offsets", "starts_m"),
    [("[[20, 0], [40, 0]]", (-10, -30, -50)), ("[[20, 0], [-20, 0]]", (-30, -50, -10))],
)
def test_offsets_keep_apart_at_a_sharp_turn_and_check_says_so(
    offsets: str, starts_m: tuple[float, ...]
) -> None:
    starts = {name: (east_m, 0.0) for name, east_m in zip("abc", starts_m, strict=True)}
    fleet = sim_fleet(starts, {"way": route(*SHARP)})
    mission = one_task("formation", route="way", offsets=offsets)
    found = judged(fleet, mission)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.least_m >= 16, found
    (finding,) = checked_in(fleet, mission)
    assert finding.rule == "members-meet"
    assert finding.place is not None
    assert math.dist(FRAME.to_local(finding.place), SHARP[1]) < 0.2


@pytest.mark.parametrize("given", [{"spacing": "20 m"}, {"offsets": "[[20, 0], [40, 5]]"}])
def test_check_finds_a_spacing_below_the_separation_of_the_fleet(given: dict[str, str]) -> None:
    fleet = column([(0.0, 0.0), (200.0, 0.0)], 3).fleet()
    mission = one_task("formation", route="way", **given)
    assert checked_in(fleet, mission) == []
    (finding,) = checked_in(replace(fleet, surface_separation_m={Domain.GROUND: 18.0}), mission)
    assert f"parameter '{next(iter(given))}': members come within 16" in finding.message


@pytest.mark.parametrize("policy", LostMemberPolicy)
@pytest.mark.parametrize("failsafe", ["", "hold", "return_to_launch"])
def test_check_finds_a_member_that_moves_on_when_the_others_go_on_without_it(
    policy: LostMemberPolicy, failsafe: str
) -> None:
    case = column([(0.0, 0.0), (200.0, 0.0)], 3)
    fleet = case.fleet(policy)
    vehicles = {**fleet.vehicles, "b": replace(fleet.vehicles[ResourceId("b")], failsafe=failsafe)}
    found = checked_in(replace(fleet, vehicles=vehicles), case.mission)
    meets = policy is LostMemberPolicy.CONTINUE and failsafe == "return_to_launch"
    assert [each.rule for each in found] == ["moves-when-lost"] * meets
    assert all("b (" in each.message and failsafe in each.message for each in found)


def test_check_finds_nothing_where_members_keep_apart() -> None:
    assert checked(column([(0.0, 0.0), (200.0, 0.0), (200.0, 200.0)])) == []


def test_a_column_goes_around_the_member_that_it_has_lost() -> None:
    case = column([(0.0, 0.0), (200.0, 0.0), (200.0, 150.0), (60.0, 150.0)], 3)
    lost = "b", Fault("lose_link", after_s=30.0)
    found = judged(case.fleet(LostMemberPolicy.CONTINUE), case.mission, lost)
    assert found.ended.state is BehaviorState.SUCCEEDED
    assert found.ended.reason.startswith("without b (LINK_LOST")
    assert found.least_m >= 16


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("hole", [False, True])
def test_a_way_around_a_lost_member_keeps_to_the_fence(side: int, hole: bool) -> None:
    """The fence is near on one side; on the other one, it is wide, or has a hole."""
    outer = [
        (-90.0, -12.0 * side),
        (290.0, -12.0 * side),
        (290.0, 90.0 * side),
        (-90.0, 90.0 * side),
    ]
    inner = [(x, y * side) for x, y in ((100.0, 15.0), (180.0, 15.0), (180.0, 50.0), (100.0, 50.0))]
    found = fenced(shapely.Polygon(outer).difference(shapely.Polygon(inner if hole else [])))
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.ended.reason.startswith("without b (LINK_LOST")
    assert found.least_m >= 16, found
    assert max(abs(north) for _, north in found.tracks["c"]) > 15, "it went around"


def test_a_team_fails_where_no_way_within_the_fence_leads_around_a_lost_member() -> None:
    found = fenced(shapely.box(-90.0, -12.0, 290.0, 12.0))
    assert found.ended.state is BehaviorState.FAILED, found
    assert found.ended.reason == "c cannot go around b, which is lost"
    assert found.least_m >= 16, found


@pytest.mark.parametrize("side", [1, -1])
def test_a_way_around_a_lost_member_keeps_out_of_shared_space_without_a_place(side: int) -> None:
    pond = shapely.box(100.0, min(12.0 * side, 90.0 * side), 180.0, max(12.0 * side, 90.0 * side))
    found = fenced(pond, closed=True)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.ended.reason.startswith("without b (LINK_LOST")
    assert found.least_m >= 16, found
    assert max(abs(north) for _, north in found.tracks["c"]) > 15, "it went around"


def fenced(yard: shapely.Polygon, *, closed: bool = False) -> Judged:
    """A column loses its second member; no vehicle leaves an area, or (`closed`) enters it."""
    case = column([(0.0, 0.0), (250.0, 0.0)], 3)
    fleet = case.fleet(LostMemberPolicy.CONTINUE)
    rings = [[(x, y) for x, y in each.coords[:-1]] for each in (yard.exterior, *yard.interiors)]
    drawn = {"yard": Area(tuple(area(*ring).rings[0] for ring in rings))}
    space = {"yard": SharedSpace("yard", 0)} if closed else {}
    fleet = replace(fleet, closed_space=space, geometries={**fleet.geometries, **drawn})
    fleet = fleet if closed else replace(fleet, fence="yard")
    found = judged(fleet, case.mission, ("b", Fault("lose_link", after_s=30.0)))
    for track in map(shapely.LineString, found.tracks.values()):
        kept_out = track.intersection(yard.buffer(-0.1)) if closed else track - yard.buffer(0.1)
        assert kept_out.length < 0.1
    return found


def test_nobody_crosses_a_bridge_on_which_a_member_was_lost() -> None:
    case = replace(column([(0.0, 0.0), (200.0, 0.0)], 3), behavior="bridge_crossing")
    lost = "a", Fault("lose_link", after_s=10.0)
    found = judged(case.fleet(LostMemberPolicy.CONTINUE), case.mission, lost)
    assert (found.ended.state, found.ended.code) == (BehaviorState.FAILED, "LINK_LOST")
    assert found.ended.reason.endswith("the others cannot pass it")
    assert found.least_m > 19.9


def checked(case: Case) -> list[Finding]:
    """What `m2pem check` finds."""
    return checked_in(case.fleet(), case.mission)


def checked_in(fleet: Fleet, mission: bytes) -> list[Finding]:
    plugins = PluginManager(block=("all",))
    connected = FleetArbiters(fleet, plugins, context(SystemClock()))
    return findings_for(parse_mission(mission, "m.bpmn"), connected, plugins)


def test_members_in_each_others_ways_to_the_route_go_around_each_other_and_that_is_said(
    caplog: pytest.LogCaptureFixture,
) -> None:
    places = [(0.0, 0.0), (200.0, 0.0), (200.0, 200.0)]
    case = column(places, 3)
    starts = {"a": (40.0, 0.0), "b": (20.0, 0.0), "c": (0.0, 5.0)}
    found = judged(sim_fleet(starts, {"way": route(*places)}), case.mission)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.least_m >= 16, found
    assert "members go around others that wait to set off" in caplog.text


def scattered(case: Case, seed: int) -> Fleet:
    """The members at random places around the route, in any order."""
    random, starts = Random(seed), dict[str, tuple[float, float]]()
    bounds = [(min(axis) - 60, max(axis) + 60) for axis in zip(*case.places, strict=True)]
    for name in case.names:
        while name not in starts:
            place = random.uniform(*bounds[0]), random.uniform(*bounds[1])
            if all(math.dist(place, each) >= 1.2 * case.spacing_m for each in starts.values()):
                starts[name] = place
    aloft = {"altitude": "30 m"} if case.domain is Domain.AIR else {}
    return sim_fleet(
        starts,
        {"way": route(*case.places)},
        domains=dict.fromkeys(case.names, case.domain),
        settings={
            name: {"max_speed": f"{speed} m/s"} | aloft
            for name, speed in zip(case.names, case.speeds_m_s, strict=True)
        },
    )


def check_scattered(seed: int) -> bool:
    """Whether it was carried out."""
    case = Case.of(seed)
    with named(seed):
        found = judged(scattered(case, seed + 1000), case.mission)
        if refused(found):
            return False
        assert found.ended.state is BehaviorState.SUCCEEDED, (case, found)
        assert found.least_m >= 0.8 * case.spacing_m, (case, found)
        return True


@pytest.mark.parametrize("seed", [1, 3, 6, 11, 15, 38, 193, 418, 434, 582])
def test_members_that_begin_anywhere_keep_apart_on_their_ways_to_the_route(seed: int) -> None:
    assert check_scattered(seed)


def test_members_that_cannot_come_to_the_route_are_refused_with_what_to_do() -> None:
    case = Case.of(209)  # a short route between them
    found = judged(scattered(case, 1209), case.mission)
    assert refused(found)
    assert "are in each other's ways; let the members begin" in found.ended.reason


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 600, 50))
def test_members_that_begin_at_six_hundred_places_keep_apart(first: int) -> None:
    carried_out = [check_scattered(seed) for seed in range(first, first + 50)]
    assert sum(carried_out) >= 25, "the rest has routes on which no column fits"


def test_a_lead_that_begins_at_the_end_of_the_route_comes_back_and_leads() -> None:
    places = [(-621.5, -249.5), (-355.8, -414.2), (-120.2, -294.5), (-10.0, -59.8), (0.0, 0.0)]
    starts = {"a": places[-1], "b": (-680.0, -280.0), "c": (-700.0, -290.0)}
    case = Case("abc", "column", 20.0, places, Domain.GROUND)
    found = judged(sim_fleet(starts, {"way": route(*places)}), case.mission)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.least_m >= 16


def test_a_lead_goes_around_others_that_wait_beside_the_route() -> None:
    places = [(-1.8, -44.1), (5.8, -36.6), (9.8, -25.0), (7.9, -12.8), (3.0, -0.2), (1.1, 12.0)]
    case = Case("abc", "column", 20.0, places, Domain.GROUND)
    starts = {"a": (0.0, 0.0), "b": (-1.9, -21.1), "c": (-3.7, -42.1)}
    found = judged(sim_fleet(starts, {"way": route(*places)}), case.mission)
    assert found.ended.state is BehaviorState.SUCCEEDED, found
    assert found.least_m >= 16, found
