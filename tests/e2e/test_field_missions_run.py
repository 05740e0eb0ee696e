"""The field-test vignettes, run to each of their ends as an operator runs them, on a fast clock."""

import json

from m2pem.mission.elements import EndEvent
from tests.command_line import CommandLine

from .test_field_missions import ANSWERS, FLEET, Story, every_story_when_long, mission

SPEED = 100
INNER = {"DETECTION", "ADVANCE"}
"""Called processes, whose end events are not ends of the vignette."""


@every_story_when_long
def test_the_vignette_is_run_to_its_end(m2pem: CommandLine, story: Story) -> None:
    status, out, _ = m2pem.run(
        "run", story.mission, "--fleet", FLEET, "--simulate", "--speed", str(SPEED),
        "--ocu", "none", "--answers", ANSWERS / f"{story.answers}.yaml", "--format", "json",
    )  # fmt: skip
    assert status == 0
    records = [json.loads(line) for line in out.splitlines()]
    (ended,) = (each for each in records if each["record"] == "RunEnded")
    assert ended["outcome"] == story.status.value
    ends = {
        node.id
        for process in mission(story.mission).processes
        if process.id not in INNER
        for node in process.nodes
        if isinstance(node, EndEvent)
    }
    entered = {each["element"] for each in records if each["record"] == "TokenEntered"}
    assert ends & entered == set(story.ends)
    released = [each["behavior"] for each in records if each["record"] == "BehaviorEnded"]
    requested = [each["behavior"] for each in records if each["record"] == "BehaviorRequested"]
    assert sorted(released) == sorted(requested)
