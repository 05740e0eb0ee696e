"""What a variations file draws has its effect on runs of the repository's missions."""

from pathlib import Path

import pytest

from m2pem.campaign.runs import Row, order_of, rehearse_runs
from m2pem.executive.loading import load_source
from m2pem.fleet.fleet_file import load_fleet

REPOSITORY = Path(__file__).parents[2]
STOP = "dc45ff2b-ef6b-45bd-96e6-c7ac8ef055c2"


def one_run(name: str, variations: str) -> Row:
    mission = load_source(REPOSITORY / "missions" / f"{name}.bpmn")
    fleet = load_fleet(REPOSITORY / "fleet_configs" / f"{name}.yaml")
    [row] = rehearse_runs(order_of(mission, fleet, variations.encode(), 7), [0])
    assert not row["error"]
    return row


@pytest.fixture(scope="module")
def plain() -> Row:
    return one_run("vignette1", "")


@pytest.mark.parametrize(
    ("variations", "outcome", "end", "took_s"),
    [
        ("behaviors: {DriveRoute: {duration: 300 s}}", "terminated", "EndMission", 300.0),
        (
            "behaviors: {DriveRoute: {fails: {probability: 1, after: 10 s, error: BLOCKED}}}",
            "failed",
            "BLOCKED",
            10.0,
        ),
        ("answers: {UserSendRoute: {abort: 1}}", "terminated", "EndMission", 0.0),
        ("links: [{vehicle: evsg1, at: 20 s}]", "failed", "LINK_LOST", 23.0),
    ],
)
def test_it_decides_how_and_when_a_run_ends(
    variations: str, outcome: str, end: str, took_s: float
) -> None:
    row = one_run("vignette1", variations)
    assert (row["outcome"], row["end"], row["took_s"]) == (outcome, end, took_s)


def test_a_factor_slows_the_vehicle_on_the_same_way(plain: Row) -> None:
    row = one_run("vignette1", "behaviors: {DriveRoute: {duration_factor: 1.5}}")
    assert row["took_s"] == pytest.approx(1.5 * plain["took_s"])
    assert row["distance.evsg1"] == pytest.approx(plain["distance.evsg1"])
    assert row["battery.evsg1"] < plain["battery.evsg1"]
    assert row["drawn.behaviors.DriveRoute.duration_factor"] == 1.5


def test_the_time_that_an_operator_takes_delays_the_mission(plain: Row) -> None:
    said = "answers: {UserSendRoute: {continue: 1}}"
    at_once = one_run("vignette1", said)
    late = one_run("vignette1", f"{said}\nanswer_times: {{UserSendRoute: 100 s}}")
    assert at_once["took_s"] == plain["took_s"]
    assert late["took_s"] == pytest.approx(plain["took_s"] + 100)
    assert late["drawn.answers.UserSendRoute.after"] == 100


def test_a_signal_comes_at_its_time(plain: Row) -> None:
    row = one_run("vignette1", f"signals: [{{id: {STOP}, at: 30 s}}]")
    assert 0 < row["distance.evsg1"] < plain["distance.evsg1"]
    assert 30 < row["took_s"] < plain["took_s"]


def test_speed_and_battery_of_a_vehicle_are_its_own(plain: Row) -> None:
    row = one_run("vignette1", "vehicles: {evsg1: {battery: 50 %, max_speed: 2 m/s}}")
    assert row["distance.evsg1"] == pytest.approx(plain["distance.evsg1"])
    assert row["took_s"] > 2 * plain["took_s"]
    assert row["battery.evsg1"] < 0.5 < row["battery.evsg2"]


def test_wind_delays_aircraft() -> None:
    still, windy = one_run("survey_pair", ""), one_run("survey_pair", "wind: {speed: 14 m/s}")
    assert windy["took_s"] > still["took_s"]
    assert windy["battery.uav1"] < still["battery.uav1"]
    assert windy["distance.uav1"] == pytest.approx(still["distance.uav1"])
