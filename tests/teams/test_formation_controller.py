"""The controller keeps members in their places: on random routes, with random carts and delays."""

import math
from collections import deque

import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from m2pem.api.behavior_parameters import BehaviorParameters
from m2pem.fleet.behaviors import SHARED
from m2pem.geo.local_frame import LocalFrame
from m2pem.mission.behavior import BehaviorType
from m2pem.mission.catalogue import ResourceId
from m2pem.teams.behavior import PERIOD_S
from m2pem.teams.columns import lane_mates, march
from m2pem.teams.formation_controller import FormationController
from m2pem.teams.plan import MOTIONS, March, MemberPose, Plan, PlanningContext, TeamRefusedError
from tests.seeds import examples

from .carts import FRAME, Cart
from .conftest import route

STEP_S = 0.05
ROUTING = SHARED["single_vehicle_routing", BehaviorType.VEHICLE]


class Field:
    """Carts that march, seen and commanded late, as links and arbiters do."""

    def __init__(
        self,
        places: list[tuple[float, float]],
        starts: list[tuple[float, float]],
        shape: str,
        spacing_m: float,
        speed_m_s: float,
        steady: frozenset[str],
        late_s: float,
        brakes: list[float],
    ) -> None:
        names = [ResourceId(f"v{index}") for index in range(len(starts))]
        poses = {n: MemberPose(at) for n, at in zip(names, starts, strict=True)}
        setting = PlanningContext(
            tuple(names),
            dict.fromkeys(names, "ground"),
            {name: {"single_vehicle_routing": ROUTING} for name in names},
            BehaviorParameters(
                {"route": route(*places), "shape": shape, "spacing": spacing_m, "speed": speed_m_s}
            ),
            _FRAME,
            poses,
        )
        try:
            self.plan: Plan = march(setting, shape)
        except TeamRefusedError as error:  # the route leads back to where the others begin
            assert "come within" in str(error)
            reject()
        assert self.plan.march is not None
        self.march: March = self.plan.march
        self.carts = {}
        for index, leg in enumerate(self.plan.legs):
            waypoints = leg.parameters["route"].waypoints  # type: ignore[union-attr]
            self.carts[leg.member] = Cart(
                starts[index],
                wished_m_s=self.march.speed_m_s,
                brake_m_s2=brakes[index],
                ahead=[FRAME.to_local(each[:2]) for each in waypoints],
            )
        self.controller = FormationController(self.march, [ResourceId(name) for name in steady])
        self._along_m: dict[ResourceId, float | None] = dict.fromkeys(self.carts)
        self._steady = steady
        self._late = round(late_s / STEP_S)
        self._seen: deque[dict[ResourceId, MemberPose]] = deque()
        self._said: deque[dict[ResourceId, float]] = deque()
        self.stopped: set[ResourceId] = set()
        self.least_m: dict[tuple[ResourceId, ResourceId], float] = {}
        self.nearest_m: dict[tuple[ResourceId, ResourceId], float] = {}

    def run(self, limit_s: float) -> bool:
        """Until all have arrived; False if they have not in time."""
        each_steps = round(PERIOD_S / STEP_S)
        for tick in range(round(limit_s / STEP_S)):
            self._seen.append({n: MemberPose(c.place, c.yaw_rad) for n, c in self.carts.items()})
            if len(self._seen) > self._late:
                seen = self._seen.popleft()
                if tick % each_steps == 0:
                    self._said.append(self.controller.step(seen, self.arrived()))
                else:
                    self._said.append({})
            if len(self._said) > self._late:
                self._obey(self._said.popleft())
            for cart in self.carts.values():
                cart.step(STEP_S)
            self._measure()
            if len(self.arrived()) == len(self.carts):
                return True
        return False

    def arrived(self) -> list[ResourceId]:
        return [name for name, cart in self.carts.items() if not cart.ahead]

    def _obey(self, said: dict[ResourceId, float]) -> None:
        for name, speed in said.items():
            cart = self.carts[name]
            if name in self.stopped:
                continue
            cart.halted = speed == 0.0
            if speed and name not in self._steady:
                cart.wished_m_s = speed

    def mark(self, index: int) -> float:
        marcher = self.march.marchers[index]
        cart = self.carts[marcher.member]
        along_m = marcher.path.find(cart.place, self._along_m[marcher.member], 50.0)
        self._along_m[marcher.member] = along_m
        return marcher.path.mark_m(along_m)

    def _measure(self) -> None:
        marks = [self.mark(index) for index in range(len(self.carts))]
        marchers = self.march.marchers
        for index, marcher in enumerate(marchers):
            for before in range(index):
                if not lane_mates(marcher, marchers[before], self.march.spacing_m):
                    continue
                pair = marchers[before].member, marcher.member
                gap = marks[before] - marks[index]
                if gap >= self.controller.floor_m or pair in self.least_m:
                    self.least_m[pair] = min(self.least_m.get(pair, gap), gap)
                elif gap < self.nearest_m.get(pair, math.inf) and gap > 0:
                    self.nearest_m.setdefault(pair, gap)
                    assert gap >= self.nearest_m[pair] - 0.5, "who is too near comes no nearer"


_FRAME = LocalFrame((38.1075, -77.3192))

turns = st.lists(st.tuples(st.floats(20, 120), st.floats(-1.2, 1.2)), min_size=1, max_size=5)


@st.composite
def roads(draw: st.DrawFn) -> list[tuple[float, float]]:
    """A road whose bends are no hairpins."""
    places, yaw = [(0.0, 0.0)], 0.0
    for length, turn in draw(turns):
        east, north = places[-1]
        places.append((east + length * math.cos(yaw), north + length * math.sin(yaw)))
        yaw += turn
    return places


@settings(
    max_examples=examples(10, 40), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
@given(
    places=roads(),
    count=st.integers(2, 5),
    spacing=st.floats(5, 40),
    speed=st.floats(1, 12),
    late_s=st.floats(0, 0.2),
    steady=st.sets(st.sampled_from(["v0", "v1", "v2", "v3", "v4"])),
    brakes=st.lists(st.floats(2.0, 6.0), min_size=5, max_size=5),
    data=st.data(),
)
def test_a_column_never_closes_up_to_less_than_half_of_its_spacing_and_always_arrives(
    places: list[tuple[float, float]],
    count: int,
    spacing: float,
    speed: float,
    late_s: float,
    steady: set[str],
    brakes: list[float],
    data: st.DataObject,
) -> None:
    starts = [
        (-5.0 - data.draw(st.floats(0, 60)), data.draw(st.floats(-5, 5))) for _ in range(count)
    ]
    starts.sort(reverse=True)  # in their order
    field = Field(
        places, starts, "column", spacing, speed, frozenset(steady), late_s, brakes[:count]
    )
    assert field.run(3600), [cart.place for cart in field.carts.values()]
    assert len(field.least_m) == count * (count - 1) / 2, "all have been in their places"
    for pair, least_m in field.least_m.items():
        assert least_m >= spacing / 2 - 0.5, (pair, least_m)


@settings(max_examples=examples(6, 20))
@given(
    places=roads(),
    count=st.integers(2, 4),
    victim=st.integers(0, 3),
    after_s=st.floats(5, 40),
    spacing=st.floats(8, 30),
    steady=st.booleans(),
)
def test_nobody_drives_up_to_one_who_stops_dead(
    places: list[tuple[float, float]],
    count: int,
    victim: int,
    after_s: float,
    spacing: float,
    steady: bool,
) -> None:
    starts = [(-10.0 - index * spacing, 0.0) for index in range(count)]
    every = frozenset(f"v{index}" for index in range(count)) if steady else frozenset()
    field = Field(places, starts, "column", spacing, 10.0, every, 0.2, [2.0] * count)
    field.run(after_s)
    name = ResourceId(f"v{victim % count}")
    cart = field.carts[name]
    field.stopped.add(name)
    cart.speed_m_s, cart.halted = 0.0, True
    field.run(120)
    for pair, least_m in field.least_m.items():
        assert least_m >= spacing / 2 - 0.5, (pair, least_m)


@given(places=roads(), steady=st.booleans(), slow=st.integers(0, 2))
@settings(max_examples=examples(6, 20))
def test_who_is_abreast_stays_so_though_one_is_slow(
    places: list[tuple[float, float]], steady: bool, slow: int
) -> None:
    starts = [(-10.0, 0.0), (-10.0, 10.0), (-10.0, -10.0)]
    every = frozenset(("v0", "v1", "v2")) if steady else frozenset()
    field = Field(places, starts, "line", 10.0, 6.0, every, 0.1, [3.0] * 3)
    field.carts[ResourceId(f"v{slow}")].max_m_s = 3.0
    for _ in range(400):
        if field.run(1.0):
            return
        ahead = [name for name in field.carts if name not in field.arrived()]
        marks = [field.mark(index) for index in range(3)]
        if len(ahead) == 3 and min(marks) > 0:
            # Twice the slack, and the way to a stand.
            bound_m = 2 * 9.0 + MOTIONS["ground"].stopping_m(6.0)
            assert max(marks) - min(marks) < bound_m, marks
    raise AssertionError("they have not arrived")


def test_the_formation_controller_tells_how_well_each_keeps_its_place() -> None:
    starts = [(0.0, 0.0), (-20.0, 0.0), (-40.0, 0.0), (-60.0, 0.0)]
    field = Field([(0, 0), (500, 0)], starts, "column", 20.0, 4.0, frozenset(), 0.0, [2.0] * 4)
    names = list(field.carts)
    seen = {
        names[0]: MemberPose((100.0, 0.0)),
        names[1]: MemberPose((85.0, 0.0)),
        names[2]: MemberPose((50.0, 3.0)),
    }
    assert all(each.along_m is None for each in field.controller.kept())
    field.controller.step(seen)
    first, second, third, unseen = field.controller.kept()
    assert (first.along_m, first.gap_m) == (pytest.approx(0.0, abs=0.01), None)
    assert second.along_m == pytest.approx(5.0, abs=0.01)
    assert second.gap_m == pytest.approx(15.0, abs=0.01)
    assert third.along_m == pytest.approx(-10.0, abs=0.01)
    assert third.aside_m == pytest.approx(3.0, abs=0.01)
    assert third.gap_m == pytest.approx(35.0, abs=0.01)
    assert (unseen.along_m, unseen.aside_m, unseen.gap_m) == (None, None, None)
    field.controller.drop(names[1])
    assert [each.resource for each in field.controller.kept()] == [names[0], names[2], names[3]]


def test_members_abreast_have_no_gap_and_are_off_their_own_lanes() -> None:
    field = Field(
        [(0, 0), (500, 0)],
        [(0.0, 0.0), (0.0, 20.0)],
        "line",
        20.0,
        4.0,
        frozenset(),
        0.0,
        [2.0] * 2,
    )
    one, two = field.carts
    field.controller.step({one: MemberPose((100.0, 0.0)), two: MemberPose((98.0, 21.0))})
    lead, other = field.controller.kept()
    assert lead.gap_m is None
    assert other.gap_m is None
    assert other.along_m == pytest.approx(-2.0, abs=0.1)
    assert other.aside_m == pytest.approx(1.0, abs=0.1)


def test_a_member_slows_down_behind_one_that_says_nothing_for_a_second() -> None:
    """That one may stand where it was."""
    field = Field(
        [(0, 0), (400, 0)], [(-5, 0), (-25, 0)], "column", 20.0, 3.0, frozenset(), 0.0, [1.0, 1.0]
    )
    lead, other = field.carts
    said = [
        field.controller.step(
            {
                lead: MemberPose((min(100.0 + 3.0 * tick * PERIOD_S, heard_m), 0.0), 0.0, 3.0, 0.0),
                other: MemberPose((78.0 + 3.0 * tick * PERIOD_S, 0.0), 0.0, 3.0, 0.0),
            }
        )[other]
        for heard_m in (math.inf, 100.0)
        for tick in range(6)
    ]
    heard, unheard = said[:6], said[6:]
    assert min(heard) > 2.5
    assert min(unheard[:4]) > 1.0
    assert max(unheard[4:]) < 1.0
