"""Messages for one instance among several (clause 8.4.2)."""

from m2pem.bpmn import parse_mission
from tests.engine.kit import Play
from tests.engine.notation import xml

CALLS = """
    <process id="MAIN" isExecutable="true">
      <startEvent id="start"/> <parallelGateway id="fork"/>
      <callActivity id="c1" calledElement="ASK">in 1 as n</callActivity>
      <callActivity id="c2" calledElement="ASK">in 2 as n</callActivity>
      start -> fork
      fork -> c1
      fork -> c2
    </process>
    <process id="ASK">
      <startEvent id="s"/> <receiveTask id="wait" messageRef="REPLY"/> <userTask id="done"/>
      s -> wait -> done
    </process>
"""


def keyed(text: str, roots: str) -> Play:
    """A play of `text` in which `roots` take the place of the messages declared by themselves."""
    source = xml(text)
    for name in ("REPLY", "ORDER"):
        source = source.replace(f'<message id="{name}" name="{name}"/>', "")
    return Play(parse_mission(source.replace("<process", roots + "<process", 1).encode(), "t.bpmn"))


def at(play: Play, element: str) -> list[object]:
    """The `n` of the instances that have a token on an element."""
    return [t.scope.data["n"] for t in play.run.state.tokens.values() if t.node.id == element]


KEY = '<message id="REPLY" m2pem:correlationKey="n"/>'


def test_a_message_goes_to_the_instance_that_has_its_key() -> None:
    play = keyed(CALLS, KEY).start()
    assert play.message("REPLY", {"n": 2}).at == "wait done"
    assert at(play, "done") == [2]


def test_a_message_that_matches_no_receiver_yet_is_kept_for_the_one_it_matches() -> None:
    text = CALLS.replace("s -> wait", "<userTask id='first'/>\ns -> first -> wait")
    play = keyed(text, KEY).start()
    play.message("REPLY", {"n": 2}).message("REPLY", {"n": 1}).message("REPLY", {"n": 3})
    play.answer(prompt="first").answer(prompt="first")
    assert sorted(map(str, at(play, "done"))) == ["1", "2"]
    assert [letter.keys for letter in play.run.state.kept_messages["REPLY"]] == [{"key": 3}]


def test_a_message_without_a_key_goes_to_who_has_waited_longest() -> None:
    play = keyed(CALLS, KEY).start().message("REPLY")
    assert at(play, "done") == [1]


def test_a_key_that_cannot_be_worked_out_is_an_error_of_the_sender() -> None:
    text = """
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/>
          <sendTask id="send" messageRef="REPLY"/>
          start -> send
        </process>
        <process id="OTHER"> <startEvent id="s">message REPLY</startEvent> <task id="t"/> s -> t
        </process>
    """.replace(" s -> t", "\n s -> t")
    play = keyed(text, '<message id="REPLY" m2pem:correlationKey="1 / n"/>').start({"n": 0})
    assert play.ended == "failed"
    assert "correlation of message REPLY" in play.detail


# --- correlation properties ---------------------------------------------------------------------

PROPERTY = """
    <message id="REPLY"/> <message id="ORDER"/>
    <correlationProperty id="cp" name="order">
      <correlationPropertyRetrievalExpression messageRef="REPLY">
        <messagePath>number</messagePath></correlationPropertyRetrievalExpression>
      <correlationPropertyRetrievalExpression messageRef="ORDER">
        <messagePath>n</messagePath></correlationPropertyRetrievalExpression>
    </correlationProperty>
"""
SUBSCRIPTION = """
    <correlationSubscription correlationKeyRef="ck"><correlationPropertyBinding
      correlationPropertyRef="cp"><dataPath>n</dataPath></correlationPropertyBinding>
    </correlationSubscription></process>
"""


def test_a_process_subscribes_to_messages_by_its_own_data() -> None:
    text = CALLS.replace("s -> wait -> done\n    </process>", f"s -> wait -> done\n{SUBSCRIPTION}")
    play = keyed(text, PROPERTY).start()
    play.message("REPLY", {"number": 2})
    assert at(play, "done") == [2]
    assert play.message("REPLY", {"number": 7}).at == "wait done"


def test_a_conversation_goes_on_with_the_instance_that_began_it() -> None:
    text = """
        <process id="MAIN" isExecutable="true"> <startEvent id="start"/> <userTask id="idle"/>
          start -> idle
        </process>
        <process id="ORDERS"> <startEvent id="got">message ORDER</startEvent>
          <receiveTask id="wait" messageRef="REPLY"/> <userTask id="done"/>
          got -> wait -> done
        </process>
    """
    play = keyed(text, PROPERTY).start()
    play.message("ORDER", {"n": 1}).message("ORDER", {"n": 2}).message("REPLY", {"number": 2})
    assert play.at == "idle wait done"
    assert at(play, "done") == [2]
    scopes = play.run.state.scopes.values()
    assert [s.data.get("correlation.order") for s in scopes if s.container.id == "ORDERS"] == [1, 2]


def test_the_answer_finds_the_instance_that_asked() -> None:
    text = """
        <process id="MAIN" isExecutable="true">
          <startEvent id="start"/> <parallelGateway id="fork"/>
          <callActivity id="c1" calledElement="ASK">in 1 as n</callActivity>
          <callActivity id="c2" calledElement="ASK">in 2 as n</callActivity>
          start -> fork
          fork -> c1
          fork -> c2
        </process>
        <process id="ASK">
          <startEvent id="s"/> <sendTask id="ask" messageRef="ORDER"/>
          <receiveTask id="wait" messageRef="REPLY"/> <userTask id="done"/>
          s -> ask -> wait -> done
        </process>
    """
    play = keyed(text, PROPERTY).start().message("REPLY", {"number": 2})
    assert at(play, "done") == [2]


def test_a_message_that_cannot_be_matched_is_ignored() -> None:
    roots = PROPERTY.replace("number<", "1 / number<")
    play = keyed(CALLS, roots).start().message("REPLY", {"number": 0})
    assert play.ignored().startswith("message REPLY cannot be matched")
