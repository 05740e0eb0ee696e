"""Roles whose vehicle the run keeps between its tasks: the engine's part (docs/allocation.md)."""

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.commands import StartBehavior
from tests.engine.kit import Play
from tests.engine.test_allocations import FLEET, choose, commands, task

NEED = 'requires="true" store="who"'


def play(keep: str, later: str = 'same="who"') -> Play:
    """In a subprocess: a task that keeps its vehicle, a user task, another task."""
    return Play(
        f"""<startEvent id="start"/>
        <subProcess id="search"><startEvent id="s"/> {task("go", f'{NEED} keep="{keep}"')}
          <userTask id="look"/> {task("back", later)} <endEvent id="e"/>
          s -> go -> look -> back -> e
        </subProcess>
        <userTask id="then"/>
        start -> search -> then
        """,
        fleet=FLEET,
    ).start()


def kept(world: Play) -> dict[str, str]:
    """What is kept now, and until the end of what."""
    return {name: each.until.container.id for name, each in world.run.state.kept.items()}


def ends(world: Play) -> list[tuple[str, str]]:
    records = [each for each in world.records() if isinstance(each, r.KeepingEnded)]
    return [(each.resource, each.reason) for each in records]


@pytest.mark.parametrize("keep", ["subprocess", "process"])
def test_a_vehicle_is_kept_until_the_scope_ends(keep: str) -> None:
    world = choose(play(keep), "ugv2")
    until = "search" if keep == "subprocess" else world.run.state.root.container.id  # type: ignore[union-attr]
    assert [type(each).__name__ for each in world.steps[-1].records[-2:]] == [
        "BehaviorRequested",
        "ResourceKept",
    ]
    world.report("go")
    assert kept(world) == {"ugv2": until}
    world.answer()
    choose(world, "ugv2", allocation="r1.a2")
    start = commands(world)[-1]
    assert isinstance(start, StartBehavior)
    assert start.keepings == ("r1.k1",)
    world.report("back")
    assert world.at == "then"
    assert kept(world) == ({} if keep == "subprocess" else {"ugv2": until})
    world.answer()
    assert kept(world) == {}
    assert ends(world) == [("ugv2", "")]


def test_the_last_task_that_has_it_ends_the_keeping() -> None:
    world = choose(play("process", 'same="who" keep="task"'), "ugv2")
    world.report("go").answer()
    choose(world, "ugv2", allocation="r1.a2")
    assert kept(world) == {}
    assert ends(world) == [("ugv2", "back is the last task to have it")]
    assert world.run.state.held == {"ugv2": ["r1.b2"]}


def test_what_is_kept_by_an_inner_scope_is_kept_for_longer_by_an_outer_one() -> None:
    world = choose(play("subprocess", 'same="who" keep="process"'), "ugv2")
    world.report("go").answer()
    choose(world, "ugv2", allocation="r1.a2")
    root = world.run.state.root
    assert kept(world) == {"ugv2": root.container.id}  # type: ignore[union-attr]
    assert [each.keeping for each in world.records() if isinstance(each, r.ResourceKept)] == [
        "r1.k1",
        "r1.k2",
    ]


def test_a_task_that_is_done_again_keeps_what_it_has_now() -> None:
    world = Play(
        f"""<startEvent id="start"/> {task("go", f'{NEED} keep="process"')} <userTask id="again"/>
        start -> go -> again -> go
        """,
        fleet=FLEET,
    ).start()
    choose(world, "ugv1").report("go")
    world.answer()
    choose(world, "ugv2", allocation="r1.a2")
    assert list(kept(world)) == ["ugv2"]
    assert ends(world) == [("ugv1", "go has ugv2 now")]


@pytest.mark.parametrize("way", ["stop", "error"])
def test_nothing_is_kept_when_its_scope_is_left_another_way(way: str) -> None:
    world = choose(play("subprocess"), "ugv1")
    if way == "stop":
        world.stop()
    else:
        world.fault("ugv1")
    assert kept(world) == {}
    assert ends(world) == [("ugv1", "")]


def test_a_lost_vehicle_is_kept_no_more_if_another_does_the_rest() -> None:
    role = f'{NEED} keep="process" onLoss="reassign"'
    world = Play(
        f"""<startEvent id="start"/> {task("go", role)} <userTask id="then"/>
        start -> go -> then
        """,
        fleet=FLEET,
    ).start()
    choose(world, "ugv1").fault("ugv1", reachable=False)
    assert kept(world) == {}
    choose(world, "ugv2", allocation="r1.a2")
    assert list(kept(world)) == ["ugv2"]


def test_another_scope_cannot_have_what_is_kept() -> None:
    world = Play(
        f"""<startEvent id="start"/> <parallelGateway id="fork"/>
        <subProcess id="search"><startEvent id="s"/> {task("go", f'{NEED} keep="subprocess"')}
          <userTask id="look"/>
          s -> go -> look
        </subProcess>
        <userTask id="wait"/> {task("other", 'vehicle="ugv1"')}
        start -> fork -> search
        fork -> wait -> other
        """,
        fleet=FLEET,
    ).start()
    choose(world, "ugv1").report("go")
    world.answer(prompt="p1")
    assert world.ended == "failed"
    assert "ugv1 is kept for go until search ends" in world.detail


def test_a_task_with_a_greater_priority_takes_what_is_kept_and_idle() -> None:
    world = choose(play("process"), "ugv1").report("go")
    world.give(i.BehaviorPreempted("r1.k1", "ugv1", "r2.a1", "it is needed"))
    assert kept(world) == {}
    assert ends(world) == [("ugv1", "it is needed")]


def test_a_behavior_that_is_preempted_keeps_nothing() -> None:
    world = choose(play("process"), "ugv1")
    world.give(i.BehaviorPreempted("r1.b1", "ugv1", "r2.a1", "it is needed"))
    assert ends(world)[0] == ("ugv1", "it is needed")
