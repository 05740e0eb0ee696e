"""`make demo-ros`: two missions over DDS, by an operator in a process of its own."""

import os
import signal
import subprocess
from pathlib import Path

import pytest
from m2pem_plugin_ros.loopback import environment, main

REPOSITORY = Path(__file__).parents[4]
ENDED_WITHIN_S = 400


@pytest.mark.long
@pytest.mark.timeout(ENDED_WITHIN_S + 30)
def test_two_missions_go_their_ways_to_their_ends(ros_domain: int) -> None:
    demo = subprocess.Popen(
        ["make", "--old-file=ros", "demo-ros", f"DEMO_DOMAIN={ros_domain}"],
        cwd=REPOSITORY,
        env={name: text for name, text in os.environ.items() if name != "MAKEFLAGS"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        story, _ = demo.communicate(timeout=ENDED_WITHIN_S)
    except subprocess.TimeoutExpired:
        os.killpg(demo.pid, signal.SIGTERM)
        story, _ = demo.communicate()
    assert demo.returncode == 0, story
    found, clear, section = story.split("\n\n")
    assert told(found, "active: Reverse reverse evsg1", "r1 is terminated: ")
    assert told(clear, "route route_alpha is handed over", "active: CallDetection, DriveRoute")
    assert "reverse" not in clear
    assert "r1 is terminated: " in clear
    assert told(
        section,
        "evsg3: /evsg3, plain base",
        "RouteSweep road_sweep evsg3 evsg2 evsg1",
        "DriveStop drive_stop evsg1 evsg2 evsg3",
        "Teleop teleop evsg2",
        "answer to p2: hazard: taken",
        "TraverseAlternate road_following_formation evsg2 evsg1 evsg3",
        "BridgeCrossing bridge_crossing",
        "FinalSweep road_sweep",
        "r1 is completed",
    )


def told(story: str, *steps: str) -> bool:
    """Whether the steps are told, in this order."""
    at = 0
    for step in steps:
        at = story.find(step, at)
        if at < 0:
            print(f"not told, or not then: {step}")
            return False
    return True


def test_a_shell_is_told_what_keeps_its_programs_on_this_machine() -> None:
    wanted = environment(7)
    script = f"{main(['7'])}\nenv"
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True, check=True)
    told_to = dict(line.split("=", 1) for line in done.stdout.splitlines() if "=" in line)
    assert {name: told_to[name] for name in wanted} == dict(wanted)


@pytest.mark.parametrize("words", [["102"], ["-1"], ["seven"], ["1", "2"]])
def test_what_is_no_domain_is_refused(words: list[str]) -> None:
    done = subprocess.run(["sh", "-c", main(words)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "takes a ROS domain, 0 to 101" in done.stderr
