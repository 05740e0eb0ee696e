"""Call activities of processes in other files, of global tasks, and without end."""

from m2pem.bpmn import parse_mission
from m2pem.engine.elements.subprocesses import MAX_DEPTH
from m2pem.mission.library import KeptLibrary, Source
from tests.engine.kit import Play
from tests.engine.notation import xml


def files(main: str, **others: str) -> Play:
    """A play of `main`, and of what other files, by their names, say; each has a process of its
    name in capitals."""
    library = KeptLibrary(
        Source(f"{name}.bpmn", xml(text).encode(), (("call", name.upper(), ""),))
        for name, text in others.items()
    )
    return Play(parse_mission(xml(main).encode(), "main.bpmn", library))


MAIN = """
    <startEvent id="s"/> <endEvent id="e"/> <userTask id="before"/>
    <callActivity id="call" calledElement="SEARCH">in speed as fast, out found as result
    </callActivity>
    s -> before -> call -> e
"""


def search(inside: str) -> str:
    return f'<process id="SEARCH">{inside}</process>'


def test_a_process_of_another_file_gets_what_is_mapped_and_gives_it_back() -> None:
    play = files(
        MAIN,
        search=search("""
            <startEvent id="s"/> <endEvent id="e"/>
            <scriptTask id="before">found = fast * 2 ; speed = 0</scriptTask>
            s -> before -> e
        """),
    ).start({"speed": 3})
    assert play.answer().ended == "completed"
    assert play.data == {"speed": 3, "user.decision": "done", "result": 6}
    assert play.entered() == "s before call search:s search:before search:e e"


def test_camundas_and_zeebes_mappings_reach_another_file() -> None:
    for mapping in (
        '<camunda:in source="speed" target="fast" xmlns:camunda="http://camunda.org/schema/1.0/bpmn"/>'
        '<camunda:out sourceExpression="${found}" target="result" '
        'xmlns:camunda="http://camunda.org/schema/1.0/bpmn"/>',
        '<z:calledElement processId="SEARCH" xmlns:z="http://camunda.org/schema/zeebe/1.0"/>'
        '<z:ioMapping xmlns:z="http://camunda.org/schema/zeebe/1.0">'
        '<z:input source="= speed" target="fast"/><z:output source="= found" target="result"/>'
        "</z:ioMapping>",
    ):
        play = files(
            f"""
            <startEvent id="s"/> <callActivity id="call" calledElement="SEARCH"><extensionElements>
            {mapping} </extensionElements></callActivity>
            s -> call
            """,
            search=search('<scriptTask id="t">found = fast + 1</scriptTask>'),
        ).start({"speed": 3})
        assert play.data["result"] == 4


def test_a_signal_reaches_catchers_of_all_files_by_its_id() -> None:
    play = files(
        """
        <startEvent id="s"/> <userTask id="u"/> <callActivity id="call" calledElement="SEARCH"/>
        <boundaryEvent id="stop" attachedToRef="u">signal found</boundaryEvent>
        s -> u
        s -> call
        """,
        search=search("""
            <startEvent id="s"/> <intermediateCatchEvent id="w">signal go</intermediateCatchEvent>
            <intermediateThrowEvent id="t">signal found</intermediateThrowEvent>
            s -> w -> t
        """),
    ).start()
    assert play.at == "u search:w"
    assert play.signal("go").ended == "completed"


def test_an_error_of_another_file_is_caught_by_its_code() -> None:
    play = files(
        """
        <startEvent id="s"/> <callActivity id="call" calledElement="SEARCH"/> <userTask id="after"/>
        <boundaryEvent id="lost" attachedToRef="call">error LOST</boundaryEvent>
        s -> call
        lost -> after
        """,
        search=search("""
            <startEvent id="s"/> <endEvent id="lost">error LOST</endEvent>
            s -> lost
        """),
    ).start()
    assert play.at == "after"


def test_expressions_of_another_file_know_its_own_ids() -> None:
    play = files(
        MAIN,
        search=search("""
            <startEvent id="s"/> <userTask id="a"/> <userTask id="b"/> <endEvent id="e"/>
            <complexGateway id="join"><activationCondition>fa &gt; 0 and fb &gt; 0
            </activationCondition></complexGateway>
            s -> a
            s -> b
            fa: a -> join
            fb: b -> join
            join -> e
        """),
    ).start()
    play.answer().answer(prompt="search:a")
    assert play.at == "search:b search:join"
    assert play.answer().ended == "completed"


def test_an_ad_hoc_subprocess_of_another_file_begins_what_its_expression_names() -> None:
    play = files(
        MAIN,
        search=search("""
            <adHocSubProcess id="sub" m2pem:activeElements="['b']"> <userTask id="a"/>
            <userTask id="b"/> </adHocSubProcess>
        """),
    ).start()
    assert play.answer().at == "search:b"


def test_the_typed_starts_of_processes_that_are_not_called_begin_nothing() -> None:
    play = files(
        MAIN,
        search='<process id="SEARCH"><userTask id="a"/></process>'
        '<process id="NIGHTLY"><startEvent id="n">signal go</startEvent></process>',
    ).start()
    assert play.signal("go").answer().at == "search:a"


def test_a_called_global_task_runs_as_a_process_of_its_own() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true"> <startEvent id="s"/> <endEvent id="e"/>
          <callActivity id="set" calledElement="SET">in speed as x, out y as speed</callActivity>
          <callActivity id="ask" calledElement="ASK">out user.decision as said</callActivity>
          s -> set -> ask -> e
        </process>
        <globalScriptTask id="SET" scriptLanguage="m2pem"><script>y = x + 1</script>
        </globalScriptTask>
        <globalUserTask id="ASK"><extensionElements><m2pem:decision value="yes"/>
        </extensionElements></globalUserTask>
    """).start({"speed": 1})
    assert play.at == "ASK"
    assert play.answer("yes").ended == "completed"
    assert play.data == {"speed": 2, "said": "yes"}
    assert play.entered() == "s set SET ask ASK e"


def test_a_global_task_of_another_file_is_named_after_the_file() -> None:
    play = files(MAIN, search='<process id="P"/><globalUserTask id="SEARCH"/>').start()
    assert play.answer().at == "search:SEARCH"
    assert play.answer().ended == "completed"


def test_processes_that_call_each_other_end_when_a_decision_says_so() -> None:
    play = files(
        """
        <startEvent id="s"/> <exclusiveGateway id="more" default="no"/> <endEvent id="e"/>
        <callActivity id="call" calledElement="SEARCH">in n as n, out n as n</callActivity>
        s -> more
        yes: more -> call if n > 0
        no: more -> e
        call -> e
        """,
        search=search("""
            <startEvent id="s"/> <scriptTask id="t">n = n - 1</scriptTask>
            <callActivity id="back" calledElement="MAIN">in n as n, out n as n</callActivity>
            s -> t -> back
        """),
    ).start({"n": 20})
    assert play.ended == "completed"
    assert play.data["n"] == 0


def test_processes_that_call_each_other_without_end_fail_with_recursion() -> None:
    play = files(
        '<callActivity id="call" calledElement="SEARCH"/>',
        search=search('<callActivity id="back" calledElement="MAIN"/>'),
    ).start()
    assert play.ended == "failed"
    assert f"{MAX_DEPTH} " in play.detail
    assert "RECURSION" in play.detail
    assert "process search:SEARCH is in itself 500 times" in play.detail
