"""What the instances of a multi-instance activity read and give (BPMN 2.0.2, table 10.29)."""

from m2pem.mission.values import Value
from tests.engine.instances import asked, scripted
from tests.engine.kit import Play


def test_each_instance_reads_its_own_item_and_its_counter() -> None:
    play = scripted(
        '<each in="items" item="one" isSequential="true"> </each>',
        "sum = sum + one * loopCounter; seen = one",
        items=[5, 6, 7],
        sum=0,
    )
    assert play.data == {"items": [5, 6, 7], "sum": 20, "seen": 7}


def test_an_item_may_be_a_map() -> None:
    items: Value = [{"pose": {"x": 1}}, {"pose": {"x": 2}}]
    play = scripted(
        '<each in="items" item="one"> </each>', "sum = sum + one.pose.x", items=items, sum=0
    )
    assert play.data["sum"] == 3


def test_what_an_instance_writes_to_its_item_is_seen_by_no_other() -> None:
    play = scripted(
        '<each in="items" item="one" isSequential="true"> </each>',
        "one = one + 1; one.x = 9; last = one.x",
        items=[1, 2],
    )
    assert play.data == {"items": [1, 2], "last": 9}


def test_the_collection_is_read_once() -> None:
    play = scripted(
        '<each in="items" item="one" isSequential="true"> </each>',
        "items = null; n = n + one",
        items=[1, 2, 3],
        n=0,
    )
    assert play.data == {"items": None, "n": 6}


def test_outputs_are_a_list_in_the_order_of_the_instances() -> None:
    play = asked('<each out="results" result="user">3</each>')
    play.answer("no", prompt="p2").answer(prompt="p3")
    assert "results" not in play.data
    play.answer(prompt="p1")
    assert play.data == {
        "results": [{"decision": "done"}, {"decision": "no"}, {"decision": "done"}]
    }


def test_the_item_itself_may_be_the_output() -> None:
    play = scripted(
        '<each in="items" item="one" out="results" result="one"> </each>',
        "one.y.z = one.x + 1",
        items=[{"x": 1}, {"x": 2, "y": {"w": 0}}],
    )
    assert play.data["results"] == [{"x": 1, "y": {"z": 2}}, {"x": 2, "y": {"w": 0, "z": 3}}]


def test_an_instance_that_gives_nothing_has_null_in_its_place() -> None:
    play = asked('<each out="results" result="user">3 until user.decision == "no"</each>')
    play.answer(prompt="p3").answer("no", prompt="p1")
    assert play.data["results"] == [{"decision": "no"}, None, {"decision": "done"}]


def test_no_instances_give_an_empty_list() -> None:
    assert scripted('<each out="results" result="x">0</each>', "x = 1").data == {"results": []}


def test_an_output_may_be_an_expression() -> None:
    play = scripted(
        """<multiInstanceLoopCharacteristics xmlns:zeebe="http://camunda.org/schema/zeebe/1.0">
        <extensionElements><zeebe:loopCharacteristics inputCollection="= items"
          inputElement="one" outputCollection="results" outputElement="= one * 2"/>
        </extensionElements></multiInstanceLoopCharacteristics>""",
        "x = one",
        items=[1, 2],
    )
    assert play.data["results"] == [2, 4]


def test_an_output_that_cannot_be_evaluated_is_an_error_of_the_activity() -> None:
    play = scripted(
        """<multiInstanceLoopCharacteristics xmlns:zeebe="http://camunda.org/schema/zeebe/1.0">
        <extensionElements><zeebe:loopCharacteristics inputCollection="= items"
          outputCollection="results" outputElement="= 1 / 0"/>
        </extensionElements></multiInstanceLoopCharacteristics>""",
        "x = 1",
        items=[1, 2],
    )
    assert play.ended == "failed"
    assert "output of t" in play.detail


def test_data_inputs_and_outputs_are_each_instances_own() -> None:
    play = Play("""
        <dataObject id="items"/> <dataObject id="results"/> <dataObject id="factor"/>
        <startEvent id="s"/> <endEvent id="e"/>
        <scriptTask id="t">
          <ioSpecification>
            <dataInput id="all" name="all"/> <dataInput id="in" name="value"/>
            <dataInput id="by" name="factor"/>
            <dataOutput id="out" name="answer"/> <dataOutput id="allout" name="answers"/>
          </ioSpecification>
          <dataInputAssociation><sourceRef>items</sourceRef><targetRef>all</targetRef>
          </dataInputAssociation>
          <dataInputAssociation><sourceRef>one</sourceRef><targetRef>in</targetRef>
          </dataInputAssociation>
          <dataInputAssociation><sourceRef>factor</sourceRef><targetRef>by</targetRef>
          </dataInputAssociation>
          <dataOutputAssociation><sourceRef>out</sourceRef><targetRef>given</targetRef>
          </dataOutputAssociation>
          <dataOutputAssociation><sourceRef>allout</sourceRef><targetRef>results</targetRef>
          </dataOutputAssociation>
          <multiInstanceLoopCharacteristics>
            <loopDataInputRef>all</loopDataInputRef>
            <loopDataOutputRef>allout</loopDataOutputRef>
            <inputDataItem id="one" name="item"/> <outputDataItem id="given" name="result"/>
          </multiInstanceLoopCharacteristics>
          <script>answer = value * factor</script>
        </scriptTask>
        s -> t -> e
    """).start({"items": [1, 2, 3], "factor": 10})
    assert play.data == {"items": [1, 2, 3], "factor": 10, "results": [10, 20, 30]}


def test_a_call_activity_passes_its_item_in_and_its_output_out() -> None:
    play = Play("""
        <process id="MAIN" isExecutable="true">
          <dataObject id="items"/> <dataObject id="results"/>
          <startEvent id="s"/>
          <callActivity id="call" calledElement="DOUBLE">in one as x, out y as two
            <each in="items" item="one" out="results" result="two"> </each></callActivity>
          s -> call
        </process>
        <process id="DOUBLE"> <startEvent id="s2"/>
          <scriptTask id="t">y = x * 2; z = one; loop = loopCounter</scriptTask>
          s2 -> t
        </process>
    """).start({"items": [1, 2, 3]})
    assert play.data == {"items": [1, 2, 3], "results": [2, 4, 6]}
