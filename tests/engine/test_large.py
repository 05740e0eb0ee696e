"""Large missions and long runs: nothing recurses, nothing piles up."""

import sys
from types import FrameType

import pytest

from m2pem.engine.elements import gateways
from m2pem.engine.inputs import Continue, StartRun
from m2pem.engine.run import MissionRun
from m2pem.mission.mission import Mission
from tests.engine.kit import Play
from tests.engine.notation import mission


def through(made: Mission, data: dict[str, object] | None = None) -> MissionRun:
    """Run a mission that waits for nothing, batch by batch."""
    run = MissionRun(made, None, "r1")
    run.receive(StartRun("MAIN", data or {}), 0)  # type: ignore[arg-type]
    while run.wants_continue:
        run.receive(Continue(), 0)
    return run


def test_twenty_thousand_tasks_in_a_row() -> None:
    names = [f"t{number}" for number in range(20_000)]
    tasks = "\n".join(f'<task id="{name}"/>' for name in names)
    run = through(mission(f'<startEvent id="s"/>{tasks}\ns -> {" -> ".join(names)}'))
    assert run.state.outcome == "completed"
    assert run.steps_done == 20_002  # each element, and the process at its end


@pytest.mark.parametrize("kind", ["parallel", "inclusive"])
def test_ten_thousand_branches(kind: str) -> None:
    branches = "\n".join(f'<task id="t{n}"/>\nfork -> t{n} -> join' for n in range(10_000))
    run = through(
        mission(f"""
        <startEvent id="s"/> <{kind}Gateway id="fork"/> <{kind}Gateway id="join"/>
        <endEvent id="e"/>
        s -> fork
        join -> e
        {branches}
        """)
    )
    assert run.state.outcome == "completed"
    assert run.state.last_token == 10_000


def test_a_loop_of_many_rounds_leaves_nothing_in_the_state() -> None:
    run = through(
        mission("""
        <startEvent id="s"/> <exclusiveGateway id="m"/> <exclusiveGateway id="g" default="out"/>
        <subProcess id="sub"> <startEvent id="s2"/> <scriptTask id="t">n = n + 1</scriptTask>
          s2 -> t
        </subProcess>
        <boundaryEvent id="late" attachedToRef="sub">timer PT1H</boundaryEvent>
        <boundaryEvent id="stop" attachedToRef="sub">signal go</boundaryEvent>
        <endEvent id="e"/>
        s -> m -> sub -> g
        again: g -> m if n < 3000
        out: g -> e
        late -> e
        stop -> e
        """),
        {"n": 0},
    )
    state = run.state
    assert state.outcome == "completed"
    assert state.last_token == 3001
    assert len(state.timers) < 100
    assert not (state.tokens or state.scopes or state.waits or state.catchers)


def test_many_inclusive_joins_wait_without_being_asked_again_and_again() -> None:
    # Each answer concerns one of them; asking all would make this quadratic.
    assert calls_of_gateways(100) == 2 * calls_of_gateways(50)


def calls_of_gateways(count: int) -> int:
    """How often functions of the gateways are called until so many joins have all gone on."""
    calls = "\n".join(
        f'<callActivity id="c{n}" calledElement="P"/>\nfork -> c{n}' for n in range(count)
    )
    called = 0

    def counting(frame: FrameType, event: str, _: object) -> None:
        nonlocal called
        called += event == "call" and frame.f_code.co_filename == gateways.__file__

    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="s"/> <parallelGateway id="fork"/>
          s -> fork
          {calls}
        </process>
        <process id="P"> <startEvent id="s2"/> <task id="a"/> <userTask id="u"/>
          <inclusiveGateway id="join"/> <endEvent id="e"/>
          s2 -> a -> join
          s2 -> u -> join -> e
        </process>
    """).start()
    before = sys.getprofile()
    sys.setprofile(counting)
    try:
        for _ in range(count):
            play.answer()
    finally:
        sys.setprofile(before)
    assert play.ended == "completed"
    return called
