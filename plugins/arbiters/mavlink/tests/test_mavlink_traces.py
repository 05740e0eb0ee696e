"""The simulated autopilot answers as real ones were recorded to answer (`mavlink_traces`)."""

import subprocess
import sys
from pathlib import Path

import pytest
from mavlink_recording import Recording, plain
from mavlink_scenarios import SCENARIOS, scenarios_of
from mavlink_sitl import program
from mavlink_traces import VEHICLES, compare, play_real, play_simulated, reasons, recorded
from mavlink_traces_page import page
from pymavlink.dialects.v20 import ardupilotmega as dialect

INSTANCE = 71
REPOSITORY = Path(__file__).parents[4]
ALWAYS = {"go_to", "mission", "return_to_launch"}
PLAYED = [
    pytest.param(
        vehicle,
        scenario,
        id=f"{vehicle}-{scenario.name}",
        marks=() if vehicle == "arducopter" or scenario.name in ALWAYS else pytest.mark.long,
    )
    for vehicle in VEHICLES
    for scenario in scenarios_of(vehicle)
]


@pytest.mark.parametrize(("vehicle", "scenario"), PLAYED)
def test_the_simulated_autopilot_answers_as_the_real_one(vehicle, scenario) -> None:
    found = compare(recorded(vehicle)[scenario.name], play_simulated(vehicle, scenario))
    listed = reasons(vehicle, scenario.name)
    new = [difference for difference in found if difference.key not in listed]
    gone = set(listed) - {difference.key for difference in found}
    assert not new, "differs from the real autopilot (traces/differences.yaml lists what may)"
    assert not gone, "no longer differs: take it from traces/differences.yaml"


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_scenario_of_a_vehicle_is_recorded_and_no_other(vehicle: str) -> None:
    assert set(recorded(vehicle)) == {scenario.name for scenario in scenarios_of(vehicle)}
    assert set(reasons(vehicle, "")) == set()


def test_the_page_lists_what_was_compared_and_what_is_left() -> None:
    written = Path(__file__).parent / "traces" / "README.md"
    assert written.read_text(encoding="utf-8") == page()


def test_an_answer_an_order_and_a_time_that_differ_are_found() -> None:
    real = [{"do": "arm", "ack": ["A ACCEPTED"], "mode": ["X", "Y"], "took": {"up": 20.0}}]
    assert compare(real, real) == []
    for changed in (
        {**real[0], "ack": ["A FAILED"]},
        {**real[0], "mode": ["Y", "X"]},
        {**real[0], "took": {"up": 40.0}},
        {**real[0], "took": {}},
        {**real[0], "warnings": ["Low battery"]},
        {**real[0], "texts": ["Hello"]},
        {key: value for key, value in real[0].items() if key != "mode"},
    ):
        assert len(compare(real, [changed])) == 1
    assert compare(real, [{**real[0], "took": {"up": 23.0}}]) == []
    assert compare([{**real[0], "texts": ["Hello"]}], real) == []
    assert compare(real, [])


def test_values_that_repeat_are_recorded_when_they_change() -> None:
    recording = Recording("copter", "ardupilot")
    recording.begin("look")
    for mode in (4, 4, 6, 6, 4):
        recording.take(dialect.MAVLink_heartbeat_message(2, 3, 81, mode, 4, 3))
    assert recording.trace == [
        {"do": "look", "mode": ["GUIDED", "RTL", "GUIDED"], "armed": [False], "state": ["ACTIVE"]}
    ]


def test_texts_are_compared_without_the_figures_that_change_from_run_to_run() -> None:
    assert plain("Battery 1 is low 10.40V used 12 mAh") == "Battery 1 is low NV used N mAh"
    assert plain("PreArm: Need 3D Fix\t") == "PreArm: Need 3D Fix"


def test_the_tool_compares_without_a_program() -> None:
    tool = REPOSITORY / "tools/record_autopilot"
    done = subprocess.run(
        [sys.executable, tool, "arducopter", "land"],
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "NOT LISTED" not in done.stdout


@pytest.mark.parametrize("scenario", ["go_to", "mission", "return_to_launch"])
@pytest.mark.parametrize(
    ("vehicle", "variable"),
    [
        pytest.param(vehicle, variable, marks=pytest.mark.sitl(variable))
        for vehicle, variable in (
            ("arducopter", "M2PEM_ARDUCOPTER"),
            ("ardurover", "M2PEM_ARDUROVER"),
            ("px4copter", "M2PEM_PX4"),
        )
    ],
)
def test_a_real_autopilot_still_answers_as_recorded(vehicle, variable, scenario) -> None:
    binary = program(variable)
    assert binary is not None
    trace, _ = play_real(vehicle, binary, SCENARIOS[scenario], INSTANCE)
    assert compare(recorded(vehicle)[scenario], trace) == []
