"""What people say of simulated vehicles: settings and faults."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from m2pem_plugin_ros.settings import DriverName, Settings
from m2pem_plugin_ros.simulator.dynamics import Chassis
from m2pem_plugin_ros.simulator.faults import GRAMMAR, KINDS, TrafficFaults, check
from m2pem_plugin_ros.simulator.sensors import DetectorSpec, Target
from m2pem_plugin_ros.simulator.specification import (
    SettingError,
    VehicleSpec,
    apply_settings,
    detector,
)
from m2pem_plugin_ros.simulator.vehicle import Vehicle

from m2pem.api.faults import FaultError

ORIGIN = (38.1075, -77.3192, 60.0)


def spec(driver: DriverName = DriverName.NODE, *, detects: bool = True) -> VehicleSpec:
    detectors = (DetectorSpec(),) if detects else ()
    return VehicleSpec("evsg1", Settings("/evsg1", driver=driver), detectors=detectors)


def test_settings_are_read_with_their_units() -> None:
    said = {
        "max_speed": "18 km/h",
        "max_reverse": 0.5,
        "acceleration": "1.5 m/s2",
        "turn_rate": "45 deg/s",
        "turn_radius": "3 m",
        "lag": "200 ms",
        "drift": "1 %",
        "noise": "5 cm",
        "battery": "80 %",
        "battery_range": "20 km",
        "battery_life": "10 h",
        "heading": "60 deg",
    }
    read = apply_settings(said, spec())
    assert read.chassis == Chassis(5.0, 0.5, 1.5, math.radians(45), turn_radius_m=3.0, lag_s=0.2)
    assert (read.inaccuracy.drift, read.inaccuracy.noise_m) == (0.01, 0.05)
    assert (read.battery, read.capacity.range_m, read.capacity.standing_s) == (0.8, 20_000, 36_000)
    assert read.start.yaw_rad == pytest.approx(math.radians(30))  # from east, counter-clockwise


def test_home_is_where_it_starts() -> None:
    read = apply_settings({"home": [38.1075, -77.3182, 62.0], "heading": "90 deg"}, spec())
    assert (read.start.east_m, read.start.north_m) == pytest.approx((87.7, 0.0), abs=0.1)
    assert (read.start.up_m, read.start.yaw_rad) == pytest.approx((2.0, 0.0))


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        (
            "max_sped",
            1,
            "max_sped: simulated vehicles know no such setting; did you mean 'max_speed'",
        ),
        ("colour", "red", "known: home, heading"),
        ("max_speed", "fast", "max_speed: 'fast' is not a number"),
        ("max_speed", 0, "max_speed: 0 is not above 0"),
        ("turn_radius", -1, "turn_radius: -1 is below 0"),
        ("acceleration", "brisk", "acceleration: 'brisk' is not a number"),
        ("heading", 60, "heading: 60 has no unit"),
        ("battery", "120 %", "battery: '120 %' is neither a percentage"),
        ("home", [95.0, 8.0], "home: [95.0, 8.0] is not a position: latitude comes first"),
        ("home", "here", "home: 'here' is not a position; write [lat, lon]"),
        ("home", ["a", "b"], "home: 'a' is not a number"),
    ],
)
def test_settings_that_make_no_sense_are_refused(key: str, value: Any, said: str) -> None:
    with pytest.raises(SettingError) as caught:
        apply_settings({key: value}, spec())
    assert said in str(caught.value)


def test_words_for_rehearsals_are_left_alone() -> None:
    assert apply_settings({"cruise_speed": 3, "endurance": "8 h"}, spec()) == spec()


def test_what_a_detector_finds_is_read() -> None:
    said = {"range": "3 m", "targets": [{"type": "mine", "position": [38.1075, -77.3192]}]}
    read = detector(said, DetectorSpec(), ORIGIN)
    assert read == DetectorSpec(range_m=3.0, targets=(Target("mine", 0.0, 0.0),))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"targts": []}, "did you mean 'targets'"),
        ({"targets": "mine"}, "targets: it is no list"),
        ({"targets": [{"type": "mine"}]}, "is not {type: gpr, position: [38.1, -77.3]}"),
        ({"range": "wide"}, "range: 'wide' is not a number"),
    ],
)
def test_what_a_detector_cannot_find_is_refused(words: dict[str, Any], said: str) -> None:
    with pytest.raises(SettingError) as caught:
        detector(words, DetectorSpec(), ORIGIN)
    assert said in str(caught.value)


class Navigation:
    """A Nav2 that notes what faults do to it."""

    def __init__(self) -> None:
        self.faults = SimpleNamespace(reject=False, hang=False, error_code=0)
        self.state = "active"

    def enter(self, state: str) -> None:
        self.state = state


class Patient:
    """A vehicle that notes what faults do to its nodes."""

    def __init__(self) -> None:
        self.vehicle, self.traffic_faults = Vehicle(spec()), TrafficFaults()
        self.nodes: list[str] = []
        self.navigation: Any = Navigation()

    @property
    def nav2(self) -> Any:
        return self.navigation

    def kill(self) -> None:
        self.nodes.append("kill")

    def kill_node(self) -> None:
        self.nodes.append("kill node")

    def start(self) -> None:
        self.nodes.append("start")

    @property
    def state(self) -> tuple[Any, ...]:
        """All that faults switch on and off."""
        vehicle, odometer = self.vehicle, self.vehicle.odometer
        switches = (odometer.frozen, odometer.nonsense, vehicle.body.stuck, vehicle.gps_lost)
        navigation = (str(self.nav2.faults), self.nav2.state)
        return (
            str(self.traffic_faults),
            *navigation,
            *switches,
            vehicle.battery.fraction,
            odometer.read(0).pose,
        )


@pytest.mark.parametrize(
    "words",
    [
        "silent",
        "stop odometry",
        "freeze odometry",
        "odometry nan",
        "stuck",
        "lose gps",
        "refuse",
        "never accept",
        "lie",
        "flood",
        "nav2 inactive",
        "nav2 reject",
        "nav2 hang",
        "nav2 abort",
    ],
)
def test_what_a_fault_begins_it_ends(words: str) -> None:
    patient, fault = Patient(), GRAMMAR.parse(f"evsg1: {words} at 2 s for 3 s")
    well = patient.state
    assert (fault.targets, fault.at_s, fault.for_s) == (("evsg1",), 2.0, 3.0)
    assert fault.effect.end is not None
    fault.effect.begin(patient)
    assert str(patient.state) != str(well)
    fault.effect.end(patient)
    assert patient.state == well


@pytest.mark.parametrize("words", ["kill", "kill node"])
def test_nodes_that_were_ended_begin_again(words: str) -> None:
    patient, fault = Patient(), GRAMMAR.parse(words)
    fault.effect.begin(patient)
    assert fault.effect.end is not None
    fault.effect.end(patient)
    assert patient.nodes == [words, "start"]


def test_numbers_in_faults_count() -> None:
    patient = Patient()
    for words in ('refuse "too wet"', "flood 100", "battery 30 %", "jump 7.5 m", "detect mine"):
        GRAMMAR.parse(words).effect.begin(patient)
    assert patient.traffic_faults == TrafficFaults(refusal="too wet", flood_per_s=100.0)
    assert patient.vehicle.battery.fraction == 0.3
    assert patient.vehicle.odometer.read(0).pose.north_m == pytest.approx(7.5)
    assert [found.type for _, found in patient.vehicle.detections()] == ["mine"]


def test_a_nav2_that_is_dead_takes_no_harm() -> None:
    patient = Patient()
    patient.navigation = None
    alive = Patient().state
    for words in ("nav2 inactive", "nav2 reject"):
        GRAMMAR.parse(words).effect.begin(patient)
    patient.navigation = Navigation()
    assert patient.state == alive


def test_every_fault_can_be_written_as_it_is_listed() -> None:
    for listed in KINDS:
        for words in listed.split(", "):
            assert GRAMMAR.parse(words).text == words


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("evsg1: sulk", "'sulk' is no action. Actions: silent; kill"),
        ("a b: silent", "'a b' are no vehicles"),
        ("jump 5 m for 3 s", "'jump 5 m' has no end"),
        ("battery 120 %", "at most 100 %"),
        ("silent at noon", "'silent at noon' is no action"),
    ],
)
def test_faults_that_make_no_sense_are_refused(words: str, said: str) -> None:
    with pytest.raises(FaultError) as caught:
        GRAMMAR.parse(words)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("words", "driver", "said"),
    [
        ("lie", DriverName.BASE, "evsg1 is a plain base; that happens to an m2pem node alone"),
        ("flood", DriverName.NAV2, "evsg1 is Nav2; that happens to an m2pem node alone"),
        ("refuse", DriverName.BASE, "that happens to an m2pem node or Nav2 alone"),
    ],
)
def test_faults_of_nodes_need_such_a_node(words: str, driver: DriverName, said: str) -> None:
    with pytest.raises(FaultError) as caught:
        check(GRAMMAR.parse(words), spec(driver))
    assert said in str(caught.value)


def test_detecting_needs_a_detector() -> None:
    check(GRAMMAR.parse("detect"), spec())
    with pytest.raises(FaultError, match="evsg1 carries no detector"):
        check(GRAMMAR.parse("detect"), spec(detects=False))
