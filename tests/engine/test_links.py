"""Link events (BPMN 2.0.2, table 10.98): sequence flows that are not drawn."""

from tests.engine.kit import Play

LINKED = """<startEvent id="start"/> <userTask id="a"/> <task id="after"/>
    <intermediateThrowEvent id="from">link L</intermediateThrowEvent>
    <intermediateCatchEvent id="to">link L</intermediateCatchEvent>
    start -> a -> from
    to -> after
"""


def test_a_token_goes_from_the_source_to_the_target_of_its_name() -> None:
    play = Play(LINKED).start()
    assert play.at == "a"
    assert play.answer().entered() == "start a from to after"
    assert play.ended == "completed"


def test_a_token_that_passes_a_link_stays_the_same() -> None:
    play = Play(LINKED).start().answer()
    tokens = {record.token for record in play.records() if hasattr(record, "token")}
    assert tokens - {0, None} == {1}


def test_several_sources_lead_to_one_target_each_token_by_itself() -> None:
    play = Play("""<startEvent id="start"/> <userTask id="after"/>
        <intermediateThrowEvent id="one">link L</intermediateThrowEvent>
        <intermediateThrowEvent id="two">link L</intermediateThrowEvent>
        <intermediateCatchEvent id="to">link L</intermediateCatchEvent>
        start -> one
        start -> two
        to -> after
    """).start()
    assert play.at == "after after"


def test_links_of_one_name_in_different_scopes_are_apart() -> None:
    inside = """<startEvent id="s"/>
        <intermediateThrowEvent id="in">link L</intermediateThrowEvent>
        <intermediateCatchEvent id="out">link L</intermediateCatchEvent> <userTask id="u"/>
        s -> in
        out -> u
    """
    play = Play(f"""<startEvent id="start"/> <subProcess id="sub">{inside}</subProcess>
        <intermediateThrowEvent id="from">link L</intermediateThrowEvent>
        <intermediateCatchEvent id="to">link L</intermediateCatchEvent> <userTask id="after"/>
        start -> sub -> from
        to -> after
    """).start()
    assert play.at == "u"
    assert play.answer().at == "after"


def test_a_link_may_lead_back() -> None:
    play = Play("""<startEvent id="start"/> <exclusiveGateway id="again" default="no"/>
        <exclusiveGateway id="merge"/> <scriptTask id="count">n = n + 1</scriptTask>
        <intermediateThrowEvent id="back">link round</intermediateThrowEvent>
        <intermediateCatchEvent id="to">link round</intermediateCatchEvent> <endEvent id="end"/>
        start -> merge -> count -> again -> back if n < 3
        no: again -> end
        to -> merge
    """).start({"n": 0})
    assert (play.ended, play.data["n"]) == ("completed", 3)


def test_an_inclusive_join_waits_for_a_token_that_can_reach_it_by_a_link() -> None:
    play = Play("""<startEvent id="start"/> <inclusiveGateway id="split"/> <userTask id="a"/>
        <task id="b"/> <intermediateThrowEvent id="from">link L</intermediateThrowEvent>
        <intermediateCatchEvent id="to">link L</intermediateCatchEvent>
        <inclusiveGateway id="join"/> <task id="end"/>
        start -> split -> a -> from
        split -> b -> join -> end
        to -> join
    """).start()
    assert play.at == "a join"
    assert play.answer().ended == "completed"
    assert play.entered().split().count("end") == 1


def test_a_subprocess_without_a_start_event_does_not_begin_at_its_link_target() -> None:
    play = Play("""<startEvent id="start"/> <subProcess id="sub"> <userTask id="u"/>
        <intermediateThrowEvent id="from">link L</intermediateThrowEvent>
        <intermediateCatchEvent id="to">link L</intermediateCatchEvent> <task id="t"/>
        u -> from
        to -> t
        </subProcess>
        start -> sub
    """).start()
    assert play.at == "u"
    assert play.answer().ended == "completed"
