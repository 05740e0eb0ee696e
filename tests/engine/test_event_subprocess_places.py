"""Where event subprocesses may stand: in processes however they begin, and in each other."""

from tests.engine.event_subprocesses import NOT, WORK, around, handler
from tests.engine.kit import Play


def test_an_event_subprocess_of_the_process_that_the_run_began_with_ends_with_the_run() -> None:
    play = Play(WORK + handler("signal go", NOT)).start()
    assert play.signal("go").at == "a hu"
    play.answer(prompt="a").answer(prompt="b")
    assert play.ended == ""
    assert play.answer().ended == "completed"


def test_an_interrupting_one_of_that_process_ends_the_run_with_it() -> None:
    play = Play(WORK + handler("signal go")).start()
    assert play.signal("go").answer().ended == "completed"


def test_an_event_subprocess_of_a_called_process_is_armed_in_each_of_its_instances() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <callActivity id="one" calledElement="P"/> <callActivity id="two" calledElement="P"/>
          start -> one
          start -> two
        </process>
        <process id="P">{WORK}{handler("signal go")}</process>
    """).start()
    assert play.at == "a a"
    assert play.signal("go").at == "hu hu"


def test_an_event_subprocess_of_a_process_that_a_trigger_began_is_armed_in_the_instance() -> None:
    play = Play(f"""
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="main"/>
          start -> main
        </process>
        <process id="P"> <startEvent id="s">message begin</startEvent> <userTask id="a"/>
          s -> a
          {handler("timer ${wait}")}
        </process>
    """).start()
    assert play.message("begin", {"wait": "PT7S"}).at == "main a"
    assert play.advance(7).at == "main hu"


def test_an_event_subprocess_within_another_is_armed_while_that_one_runs() -> None:
    inside = '<userTask id="hu"/>\nhs -> hu\n' + handler("signal deep", name="i")
    play = Play(around(WORK + handler("signal go", NOT, inside))).start()
    assert play.signal("deep").at == "a"
    assert play.signal("go").signal("go").at == "a hu hu"
    assert play.signal("deep").at == "a iu iu"
    play.answer(prompt="iu").answer(prompt="iu")
    assert play.at == "a"


def test_a_boundary_event_of_it_ends_the_handler_only() -> None:
    boundary = """<boundaryEvent id="late" attachedToRef="h">timer PT3S</boundaryEvent>
        <userTask id="l"/>
        late -> l
    """
    play = Play(around(WORK + handler("signal go", NOT) + boundary)).start()
    assert play.signal("go").advance(3).at == "a l"


AD_HOC = """<startEvent id="start"/> <userTask id="wait"/>
    <adHocSubProcess id="sub"> <userTask id="a"/> <userTask id="b"/> {handler} </adHocSubProcess>
    <task id="done"/>
    start -> wait -> sub -> done
"""


def test_an_event_subprocess_in_an_ad_hoc_subprocess_is_no_choice_and_ends_the_choosing() -> None:
    play = Play(AD_HOC.format(handler=handler("signal go"))).start().answer()
    [prompt] = play.run.state.prompts.values()
    assert [each["value"] for each in prompt.decisions] == ["a", "b", "complete"]
    play.answer("a", prompt="sub").signal("go")
    assert play.at == "hu"
    assert [each.token.node.id for each in play.run.state.prompts.values()] == ["hu"]
    assert play.answer().ended == "completed"


def test_an_event_subprocess_beside_the_choices_does_not_count_as_one() -> None:
    inside = handler("message go", NOT) + "<completionCondition>true</completionCondition>"
    play = Play(AD_HOC.format(handler=inside)).start()
    play.message("go").answer(prompt="wait")
    assert play.answer("a", prompt="sub").at == "hu a"
    assert play.answer(prompt="hu").at == "a"
    assert play.answer(prompt="a").ended == "completed"


def test_an_event_subprocess_in_a_multi_instance_subprocess_ends_each_instance_by_itself() -> None:
    play = Play(f"""<startEvent id="start"/> <task id="done"/>
        <subProcess id="sub">
          <multiInstanceLoopCharacteristics><loopCardinality>2</loopCardinality>
          </multiInstanceLoopCharacteristics>
          {WORK} {handler("message go")}
        </subProcess>
        start -> sub -> done
    """).start()
    assert play.at == "a a"
    assert play.message("go").at == "a hu"
    assert play.message("go").at == "hu hu"
    play.entered()
    assert play.answer().answer().entered() == "done"


def test_an_error_in_an_instance_begins_the_one_around_the_whole() -> None:
    play = Play(
        """<startEvent id="start"/>
        <serviceTask id="t">call Detector <each>2</each></serviceTask>
        start -> t
        """
        + handler("error E")
    ).start()
    assert play.at == "t t"
    play.fail("t", "E")
    assert play.at == "hu"
