"""Data inputs and outputs, data stores, and what messages carry (clauses 10.4.1 and 10.4.2)."""

from m2pem.engine import records as r
from tests.engine.kit import Play

STRAIGHT = """
    <startEvent id="start"/> {task} <endEvent id="end"/>
    start -> T -> end
"""
INPUT = '<dataInput id="Tin" name="limit"/>'
OUTPUT = '<dataOutput id="Tout" name="result"/>'


def task(inside: str, associations: str, script: str) -> str:
    body = f"""
        <dataObject id="speed"/> <dataObject id="answer"/>
        <scriptTask id="T"><ioSpecification>{inside}</ioSpecification>{associations}
          <script>{script}</script>
        </scriptTask>
    """
    return STRAIGHT.format(task=body)


def into(source: str, target: str, inside: str = "") -> str:
    return (
        f"<dataInputAssociation><sourceRef>{source}</sourceRef><targetRef>{target}</targetRef>"
        f"{inside}</dataInputAssociation>"
    )


def out_of(source: str, target: str, inside: str = "") -> str:
    return into(source, target, inside).replace("dataInputA", "dataOutputA")


def test_inputs_and_outputs_are_copied_when_the_activity_begins_and_ends() -> None:
    play = Play(
        task(
            INPUT + OUTPUT,
            into("speed", "Tin") + out_of("Tout", "answer"),
            "result = limit * 2\nlimit = 99",
        )
    ).start({"speed": 4, "limit": 1})
    assert play.data == {"speed": 4, "limit": 1, "answer": 8}


def test_what_is_declared_inside_hides_what_is_outside() -> None:
    play = Play(task(INPUT, "", "answer = limit")).start({"limit": 7})
    assert play.data == {"limit": 7, "answer": None}


def test_an_own_value_is_recorded_with_its_token() -> None:
    play = Play(task(INPUT, into("speed", "Tin"), "answer = limit")).start({"speed": 4})
    written = [each for each in play.records() if isinstance(each, r.DataWritten) and each.token]
    assert [(each.key, each.own) for each in written] == [("limit", 1), ("answer", 0)]


def test_a_transformation_is_evaluated_over_the_data_around() -> None:
    change = "<transformation>speed + 1</transformation>"
    play = Play(task(INPUT, into("speed", "Tin", change), "answer = limit")).start({"speed": 4})
    assert play.data["answer"] == 5


def test_assignments_are_carried_out_one_after_the_other() -> None:
    parts = """
        <assignment><from>result + 1</from><to>answer</to></assignment>
        <assignment><from>'done'</from><to>state</to></assignment>
    """
    play = Play(task(OUTPUT, out_of("Tout", "answer", parts), "result = 1")).start()
    assert play.data == {"answer": 2, "state": "done"}


def test_a_wrong_transformation_is_an_error_at_the_activity() -> None:
    change = "<transformation>1 / speed</transformation>"
    play = Play(task(INPUT, into("speed", "Tin", change), "answer = 1")).start({"speed": 0})
    assert play.ended == "failed"
    assert "mapping to limit" in play.detail


def test_a_property_of_an_activity_is_its_own() -> None:
    text = task("", '<property id="p" name="count"/>', "count = 1\nanswer = count")
    assert Play(text).start().data == {"answer": 1}


def test_a_subprocess_has_inputs_and_outputs_too() -> None:
    play = Play(f"""
        <dataObject id="speed"/> <dataObject id="answer"/> <startEvent id="start"/>
        <subProcess id="T">
          <ioSpecification>{INPUT}{OUTPUT}</ioSpecification>
          {into("speed", "Tin")}{out_of("Tout", "answer")}
          <startEvent id="in"/> <scriptTask id="do">result = limit + 1</scriptTask>
          in -> do
        </subProcess>
        start -> T
    """).start({"speed": 1})
    assert play.data == {"speed": 1, "answer": 2}


# --- data stores --------------------------------------------------------------------------------


def test_a_data_store_is_shared_by_all_processes_of_a_run() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true">
          <dataStoreReference id="ref" name="fields"/>
          <startEvent id="start"/> <scriptTask id="before">fields.done = 1; own = 1</scriptTask>
          <callActivity id="call" calledElement="CALLED"/>
          <scriptTask id="after">seen = fields.done</scriptTask>
          start -> before -> call -> after
        </process>
        <process id="CALLED">
          <startEvent id="s"/>
          <scriptTask id="add">fields.done = fields.done + 1; x = own</scriptTask>
          s -> add
        </process>
    """).start()
    assert play.data == {"own": 1, "seen": 2}
    assert play.run.state.shared.data == {"fields.done": 2}


# --- what messages and signals carry ------------------------------------------------------------

SENDS = """
    <dataObject id="speed"/>
    <startEvent id="start"/>
    <sendTask id="T" messageRef="M"><ioSpecification><dataInput id="Tin" name="limit"/>
      </ioSpecification>{association}</sendTask>
    start -> T
"""


def two(catcher: str, catch: str = "told -> x") -> str:
    return f"""
        <process id="MAIN" isExecutable="true">{SENDS.format(association=into("speed", "Tin"))}
        </process>
        <process id="OTHER"> <dataObject id="answer"/> {catcher} <userTask id="x"/>
        {catch}
        </process>
    """


def other(play: Play) -> dict[str, object]:
    [scope] = [s for s in play.run.state.scopes.values() if s.container.id == "OTHER"]
    return dict(scope.data)


def test_a_message_carries_the_data_inputs_of_its_sender() -> None:
    start = '<startEvent id="told">message M</startEvent>'
    assert other(Play(two(start)).start({"speed": 4})) == {"limit": 4}


def test_the_catcher_says_where_it_goes() -> None:
    start = f"""<startEvent id="told"><dataOutput id="o" name="limit"/>
        {out_of("o", "answer")}<messageEventDefinition messageRef="M"/></startEvent>"""
    assert other(Play(two(start)).start({"speed": 4})) == {"answer": 4}


def test_a_single_value_fits_a_single_output_of_another_name() -> None:
    start = f"""<startEvent id="told"><dataOutput id="o" name="anything"/>
        {out_of("o", "answer")}<messageEventDefinition messageRef="M"/></startEvent>"""
    assert other(Play(two(start)).start({"speed": 4})) == {"answer": 4}
    receive = f"""<receiveTask id="told" messageRef="M" instantiate="true"><ioSpecification>
        <dataOutput id="o" name="anything"/></ioSpecification>{out_of("o", "answer")}
        </receiveTask>"""
    assert other(Play(two(receive)).start({"speed": 4})) == {"answer": 4}


def test_a_kept_message_keeps_what_it_carries() -> None:
    play = Play(f"""
        {SENDS.format(association=into("speed", "Tin"))}
        <receiveTask id="got" messageRef="M"/> <userTask id="wait"/>
        T -> wait -> got
    """).start({"speed": 4})
    assert play.answer().data == {"speed": 4, "limit": 4, "user.decision": "done"}


def test_a_signal_carries_the_data_inputs_of_its_thrower() -> None:
    play = Play(f"""
        <dataObject id="speed"/> <dataObject id="answer"/>
        <startEvent id="start"/> <startEvent id="begin"/> <userTask id="wait"/>
        <intermediateThrowEvent id="throw"><dataInput id="i" name="v"/>{into("speed", "i")}
          <signalEventDefinition signalRef="S"/></intermediateThrowEvent>
        <intermediateCatchEvent id="catch"><dataOutput id="o" name="v"/>{out_of("o", "answer")}
          <signalEventDefinition signalRef="S"/></intermediateCatchEvent>
        start -> catch
        begin -> wait -> throw
    """).start({"speed": 4})
    assert play.answer().data["answer"] == 4
