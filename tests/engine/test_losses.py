"""Roles whose work goes on with another vehicle when theirs is lost: the engine's part."""

import pytest

from m2pem.engine import inputs as i
from m2pem.engine import records as r
from m2pem.engine.commands import AllocateResources
from m2pem.engine.elements.behaviors import preview_control_taken
from m2pem.mission.behavior import OnLoss
from m2pem.mission.catalogue import BehaviorState
from tests.engine.kit import CANCELLED, FAILED, Play
from tests.engine.test_allocations import FLEET, choose, commands

LOST = BehaviorState.LOST
REJECTED = BehaviorState.REJECTED


def task(role: str, kind: str = "vehicle") -> str:
    return (
        '<scriptTask id="go"><extensionElements>'
        f'<m2pem:behavior type="{kind}" name="single_vehicle_routing"><m2pem:properties>'
        '<m2pem:property name="route" value="around"/><m2pem:property name="speed" value="2 m/s"/>'
        f'</m2pem:properties><m2pem:resources><m2pem:role name="driver" {role}/>'
        "</m2pem:resources></m2pem:behavior></extensionElements></scriptTask>"
    )


REASSIGNS = 'requires="true" store="who" onLoss="reassign"'


def text(role: str = REASSIGNS, kind: str = "vehicle") -> str:
    return f"""<startEvent id="start"/> {task(role, kind)} <userTask id="then"/>
        <boundaryEvent id="lost" attachedToRef="go">error</boundaryEvent> <userTask id="caught"/>
        start -> go -> then
        lost -> caught
        """


def play(role: str = REASSIGNS, kind: str = "vehicle") -> Play:
    """A task with one of two vehicles, ugv1 has it; error LINK_LOST is caught."""
    return choose(Play(text(role, kind), fleet=FLEET).start(), "ugv1")


def running(world: Play, remaining: dict[str, object] | None = None, number: int = 2) -> Play:
    report = i.BehaviorReported(
        "r1.b1",
        number,
        BehaviorState.RUNNING,
        remaining=remaining,  # type: ignore[arg-type]
    )
    return world.give(report)


def reassigned(world: Play) -> list[r.WorkReassigned]:
    return [each for each in world.records() if isinstance(each, r.WorkReassigned)]


def test_what_is_left_is_asked_for_again_and_the_stored_name_is_of_the_new_one() -> None:
    world = running(play(), {"route": "rest"})
    world.fault("ugv1", reachable=False)
    (record,) = reassigned(world)
    assert (record.behavior, record.code, record.excluded) == ("r1.b1", "LINK_LOST", ("ugv1",))
    assert record.parameters == {"route": "rest", "speed": "2 m/s"}
    assert commands(world)[-1] == AllocateResources("r1.a2")
    choose(world, "ugv2", allocation="r1.a2")
    assert world.run.state.behaviors["r1.b2"].parameters == record.parameters
    assert world.run.state.root.data == {"who": "ugv2"}  # type: ignore[union-attr]
    world.report("b2")
    assert world.at == "then"
    assert not [each for each in world.records() if isinstance(each, r.ErrorThrown)]


def test_the_whole_work_is_left_if_nothing_was_reported() -> None:
    world = running(play())
    world.report("go", LOST)
    assert reassigned(world)[0].parameters == {"route": "around", "speed": "2 m/s"}


def test_a_last_report_says_what_is_left() -> None:
    world = running(play(), {"route": "long"})
    world.give(i.BehaviorReported("r1.b1", 3, LOST, remaining={"route": "short"}))
    assert reassigned(world)[0].parameters["route"] == "short"


def test_what_is_left_is_done_at_the_speed_that_a_revision_gave() -> None:
    world = running(play(), {"route": "rest", "speed": 2.0})
    world.revise(text().replace("2 m/s", "3 m/s"), "r1.b1")
    running(world, {"route": "short", "speed": 2.0}, number=3)
    world.report("go", LOST)
    assert reassigned(world)[0].parameters == {"route": "short", "speed": "3 m/s"}


def test_a_parameter_that_is_not_left_is_null() -> None:
    """So a loop of a route that is in its last round is not made again."""
    world = running(play(), {"route": "rest", "speed": None})
    world.report("go", LOST)
    assert reassigned(world)[0].parameters == {"route": "rest", "speed": None}


@pytest.mark.parametrize(
    ("state", "code", "kind", "is_lost"),
    [
        (LOST, "", "vehicle", True),
        (LOST, "TIMEOUT", "vehicle", True),
        (FAILED, "LINK_LOST", "vehicle", True),
        (FAILED, "BATTERY_LOW", "vehicle", True),
        (FAILED, "TAKEN_OVER", "vehicle", True),
        (REJECTED, "", "vehicle", True),
        (REJECTED, "RESOURCE_UNAVAILABLE", "vehicle", True),
        (FAILED, "", "vehicle", False),
        (FAILED, "", "payload", True),
        (FAILED, "ROUTE_BLOCKED", "vehicle", False),
        (CANCELLED, "", "vehicle", False),
    ],
)
def test_which_ends_of_a_behavior_are_losses(
    state: BehaviorState, code: str, kind: str, is_lost: bool
) -> None:
    world = play(kind=kind).report("go", state, code)
    assert bool(reassigned(world)) is is_lost
    assert world.at == ("go" if is_lost else "caught")


@pytest.mark.parametrize("role", ['requires="true"', 'requires="true" onLoss="fail"'])
def test_without_reassign_the_loss_is_the_tasks_error(role: str) -> None:
    world = play(role).fault("ugv1", reachable=False)
    assert world.at == "caught"
    assert not reassigned(world)


def test_the_error_of_the_loss_is_thrown_when_no_other_can_do_the_rest() -> None:
    world = play().fault("ugv1", reachable=False)
    world.give(i.ResourcesNotFree("r1.a2", "ugv2 is held by r2.b1", code="RESOURCE_UNAVAILABLE"))
    assert world.at == "caught"
    error = next(each for each in world.records() if isinstance(each, r.ErrorThrown))
    assert error.code == "LINK_LOST"
    assert error.reason.endswith("no other does what is left: ugv2 is held by r2.b1")


def test_the_error_of_the_loss_is_thrown_when_the_wait_for_another_is_over() -> None:
    world = play('requires="true" wait="PT10S" onLoss="reassign"')
    world.advance(60).fault("ugv1", "BATTERY_LOW")
    world.advance(9)
    assert world.at == "go"
    world.advance(1)
    assert world.at == "caught"
    error = next(each for each in world.records() if isinstance(each, r.ErrorThrown))
    assert error.code == "BATTERY_LOW"


def test_a_vehicle_that_can_still_be_reached_is_cancelled_and_its_end_changes_nothing() -> None:
    world = play().fault("ugv1", "BATTERY_LOW")
    choose(world, "ugv2", allocation="r1.a2")
    world.report("b1", CANCELLED)
    assert world.at == "go"
    assert world.run.state.held == {"ugv2": ["r1.b2"]}
    world.report("b2")
    assert world.at == "then"


def lost_work(world: Play) -> dict[str, str]:
    (token,) = world.run.state.tokens.values()
    resources = token.lost_work.resources if token.lost_work is not None else {}
    return {resource: loss.code for resource, loss in resources.items()}


def test_what_was_lost_twice_is_remembered_until_it_returns_or_the_task_ends() -> None:
    world = play().fault("ugv1", "BATTERY_LOW")
    choose(world, "ugv2", allocation="r1.a2")
    world.report("b2", LOST)
    assert lost_work(world) == {"ugv1": "BATTERY_LOW", "ugv2": "LINK_LOST"}
    world.give(i.ResourceReturned("ugv1", "LINK_LOST"))
    assert lost_work(world) == {"ugv1": "BATTERY_LOW", "ugv2": "LINK_LOST"}
    world.give(i.ResourceReturned("ugv2", "LINK_LOST"))
    world.give(i.ResourceReturned("ugv1", "BATTERY_LOW"))
    assert lost_work(world) == {}
    choose(world, "ugv1", allocation="r1.a3").report("b3")
    assert world.at == "then"
    assert lost_work(world) == {}


def test_a_vehicle_that_an_operator_gives_back_may_do_the_rest() -> None:
    world = play().give(i.ControlTaken("ugv1", "anna"))
    assert lost_work(world) == {"ugv1": "TAKEN_OVER"}
    world.give(i.ControlReturned("ugv1", "anna"))
    assert lost_work(world) == {}


def test_the_preview_of_a_takeover_says_that_another_is_looked_for() -> None:
    ((_, catcher, on_loss),) = preview_control_taken(play().run.state, "ugv1")
    assert catcher is not None
    assert on_loss is OnLoss.REASSIGN
    ((_, _, on_loss),) = preview_control_taken(play('requires="true"').run.state, "ugv1")
    assert on_loss is OnLoss.FAIL


def test_a_resource_that_ended_lost_is_known_until_it_returns_or_is_given_again() -> None:
    world = play('requires="true"').report("go", LOST)
    assert {each: x.behavior for each, x in world.run.state.lost.items()} == {"ugv1": "r1.b1"}
    world.give(i.ResourceReturned("ugv2", "LINK_LOST"))
    assert world.ignored() == "ugv2 was not lost for this run"
    world.give(i.ResourceReturned("ugv1", "LINK_LOST", "it drove on"))
    assert world.run.state.lost == {}


def test_a_loss_during_a_pause_counts_when_the_run_goes_on() -> None:
    world = play().pause().fault("ugv1", reachable=False)
    world.give(i.ResourceReturned("ugv1", "LINK_LOST"))
    assert not reassigned(world)
    world.resume()
    assert len(reassigned(world)) == 1
    assert lost_work(world) == {}


def test_a_stopped_run_reassigns_nothing() -> None:
    world = play()
    world.stop().report("b1", LOST)
    assert not reassigned(world)
    assert world.ended == "stopped"


# --- an operator is asked -------------------------------------------------------------------------

ASK = 'requires="true" store="who" onLoss="ask"'


def incident(world: Play) -> str:
    (found,) = world.run.state.incidents
    return found


def test_an_operator_is_asked_though_an_event_would_catch_the_error() -> None:
    world = running(play(ASK), {"route": "rest"}).fault("ugv1", reachable=False)
    (record,) = reassigned(world)
    assert record.asks
    assert record.excluded == ()
    assert world.at == "go"
    assert incident(world) == "r1.i1"
    assert not [each for each in world.records() if isinstance(each, r.ErrorThrown)]


def test_to_retry_is_to_do_what_is_left() -> None:
    world = running(play(ASK), {"route": "rest"}).fault("ugv1", reachable=False)
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY, "ops"))
    choose(world, "ugv2", allocation="r1.a2")
    assert world.run.state.behaviors["r1.b2"].parameters == {"route": "rest", "speed": "2 m/s"}
    world.report("b2")
    assert world.at == "then"


def test_to_retry_evaluates_the_other_parameters_again() -> None:
    world = Play(
        '<startEvent id="start"/>'
        + task(ASK).replace('value="2 m/s"', 'value="${pace}"')
        + "\nstart -> go",
        fleet=FLEET,
    ).start({"pace": 2.0})
    running(choose(world, "ugv1"), {"route": "rest"}).fault("ugv1", reachable=False)
    data = {"pace": 4.0}
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.SET_DATA, "ops", data=data))
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY, "ops"))
    choose(world, "ugv2", allocation="r1.a2")
    assert world.run.state.behaviors["r1.b2"].parameters == {"route": "rest", "speed": 4.0}


def test_to_retry_with_another_is_to_have_that_do_what_is_left() -> None:
    world = running(play(ASK), {"route": "rest"}).fault("ugv1", reachable=False)
    roles = {"driver": ("ugv2",)}
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY_WITH, "ops", roles=roles))
    behavior = world.run.state.behaviors["r1.b2"]
    assert (behavior.resources, behavior.parameters["route"]) == (("ugv2",), "rest")


def test_a_named_role_may_ask_too() -> None:
    named = task('vehicle="ugv1" onLoss="ask"')
    text = f'<startEvent id="start"/> {named}\nstart -> go'
    world = Play(text, fleet=FLEET).start()
    running(world, {"route": "rest"}).report("go", LOST)
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY, "ops"))
    assert world.run.state.behaviors["r1.b2"].parameters["route"] == "rest"


def test_who_is_asked_again_if_nothing_is_free_for_the_rest() -> None:
    world = play(ASK).fault("ugv1", reachable=False)
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.RETRY, "ops"))
    world.give(i.ResourcesNotFree("r1.a2", "ugv2 is held", code="RESOURCE_UNAVAILABLE"))
    assert incident(world) == "r1.i2"


def test_to_end_is_to_throw_the_error_that_an_event_catches() -> None:
    world = running(play(ASK), {"route": "rest"}).fault("ugv1", reachable=False)
    world.give(i.ResolveIncident("r1.i1", i.IncidentChoice.END, "ops"))
    assert world.at == "caught"
    assert not world.run.state.incidents


def test_an_error_that_is_no_loss_asks_nobody() -> None:
    world = play(ASK).report("go", FAILED, "ROUTE_BLOCKED")
    assert world.at == "caught"
    assert not world.run.state.incidents


def test_the_preview_of_a_takeover_says_that_an_operator_is_asked() -> None:
    ((_, _, on_loss),) = preview_control_taken(play(ASK).run.state, "ugv1")
    assert on_loss is OnLoss.ASK
