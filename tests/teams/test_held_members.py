"""What a member of a team can be commanded beside the team's behavior, and what it cannot."""

from typing import Any

from m2pem.api.runs import RunStatus
from m2pem.mission.catalogue import BehaviorState
from tests.executive.conftest import behavior, mission, sequence

from .conftest import one_task, route, team_task
from .rehearsed import Rehearsed, rehearsed, sim_fleet

COLUMN = {"a": (0.0, 0.0), "b": (-20.0, 0.0), "c": (-40.0, 0.0)}
ROAD = {"road": route((50, 0), (250, 0))}
MARCH = one_task("road_following_formation", route="road", spacing="20 m", speed="5 m/s")


def test_a_payload_of_a_member_is_commanded_while_the_team_marches() -> None:
    picture = behavior("Look", "take_picture", "b").replace('type="vehicle"', 'type="payload"')
    picture = picture.replace('vehicle="b"', 'payload="b/cam"')

    async def story(world: Rehearsed) -> Any:
        control = world.executive.control
        march = await control.start(MARCH)
        await world.clock.sleep(20)
        looking = await control.wait(await control.start(mission(sequence(("Look", picture)))))
        assert world.speed_m_s("b") > 1, "the march goes on"
        return looking.status, (await control.wait(march)).status

    assert rehearsed(sim_fleet(COLUMN, ROAD), story) == (RunStatus.COMPLETED, RunStatus.COMPLETED)


def test_a_member_takes_no_second_behavior_and_the_team_is_not_disturbed() -> None:
    stop = mission(sequence(("Stop", behavior("Stop", "drive_stop", "b"))))

    async def story(world: Rehearsed) -> Any:
        control = world.executive.control
        march = await control.start(MARCH)
        await world.clock.sleep(20)
        refused = await control.wait(await control.start(stop, even_if_busy=True))
        (ended,) = world.ended()
        assert world.speed_m_s("b") > 1
        return refused.status, ended, (await control.wait(march)).status

    refused, ended, march = rehearsed(sim_fleet(COLUMN, ROAD), story)
    assert refused is RunStatus.FAILED
    assert (ended.state, ended.code) == (BehaviorState.REJECTED, "RESOURCE_UNAVAILABLE")
    assert march is RunStatus.COMPLETED


def test_a_team_behavior_that_is_interrupted_gives_a_member_to_the_next_one() -> None:
    timer = (
        '<boundaryEvent id="Late" attachedToRef="Task"><timerEventDefinition>'
        "<timeDuration>PT20S</timeDuration></timerEventDefinition></boundaryEvent>"
    )
    back = behavior("Back", "reverse", "b")
    march = sequence(team_task("Task", "road_following_formation", route="road", spacing="20 m"))
    body = (
        f"{march.removesuffix('</process>')}{timer}{back}"
        '<endEvent id="E2"/><sequenceFlow id="late" sourceRef="Late" targetRef="Back"/>'
        '<sequenceFlow id="over" sourceRef="Back" targetRef="E2"/></process>'
    )

    async def story(world: Rehearsed) -> Any:
        control = world.executive.control
        summary = await control.wait(await control.start(mission(body)))
        return summary.status, world.ended(), [world.speed_m_s(name) for name in "abc"]

    status, ended, speeds = rehearsed(sim_fleet(COLUMN, ROAD), story)
    assert status is RunStatus.COMPLETED
    assert sorted(end.state for end in ended) == [
        BehaviorState.CANCELLED,
        BehaviorState.SUCCEEDED,
    ]
    assert speeds == [0, 0, 0]
