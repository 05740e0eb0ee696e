"""What another engine's file would have to say instead is said with the finding."""

import pytest
from bpmn_text import around, findings, flow, load, process

from m2pem.bpmn.foreign_syntax import (
    EXPRESSION,
    SCRIPT,
    expression_remedy,
    script_remedy,
    statement_remedy,
    time_remedy,
)
from m2pem.mission.elements import ServiceTask


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("return x > 10;", "write x > 10, without a language"),
        ("foo == 'left'", "write foo == 'left', without a language"),
        ('Vacation Approval = "Approved"', 'write = Vacation Approval = "Approved", as FEEL does'),
        ("Service Level == 'Premium'", 'write = Service Level = "Premium", as FEEL does'),
        ("some condition", EXPRESSION),
        ("return person.isTall();", EXPRESSION),
        ("x" * 100_000, EXPRESSION),
        ("return " + " " * 1_900 + "x y", EXPRESSION),
    ],
)
def test_an_expression_in_another_language(text: str, remedy: str) -> None:
    assert expression_remedy(text) == remedy


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("var x = a + 1;", "line 'x = a + 1'"),
        ("// note\nexecution.setVariable('x', \"y\");", "line 'x = \"y\"'"),
        ('kcontext.setVariable("x", 1);\nprintln x', "line 'x = 1'"),
        ("x = 1\ny = x", "lines 'x = 1', 'y = x'"),
        ('throw new org.camunda.bpm.engine.delegate.BpmnError("E1");', "line 'throw error E1'"),
    ],
)
def test_a_script_that_can_be_written_in_statements(text: str, written: str) -> None:
    assert script_remedy(text) == f'write the {written} (scriptFormat="m2pem")'


@pytest.mark.parametrize(
    "text", ['System.out.println("x = " + x);', "# note\nprint(x)", "println x"]
)
def test_a_script_that_only_prints(text: str) -> None:
    assert script_remedy(text).startswith("it only prints")
    assert statement_remedy(text).startswith("it only prints")


@pytest.mark.parametrize(
    "text", ["x++;", "for (i in list) { sum += i }", "#{bean}", "x = new Date()", "a = 1\n" * 9]
)
def test_a_script_that_cannot_be_written_otherwise(text: str) -> None:
    assert "service task" in script_remedy(text)


def test_a_line_of_a_script_in_no_language_in_particular() -> None:
    assert statement_remedy("x = 1;") == "write 'x = 1'"
    assert statement_remedy("x++;") == SCRIPT


@pytest.mark.parametrize(
    ("kind", "text", "remedy"),
    [
        ("timeDuration", "500ms", "write PT0.5S"),
        ("timeDuration", "2 h", "write PT2H"),
        ("timeDuration", "30d", "write P30D"),
        ("timeDuration", "PT10s", "write PT10S, in capitals"),
        ("timeDuration", '"PT0.2S"', "write PT0.2S alone"),
        ("timeDuration", '= duration("PT5S")', "write PT5S alone"),
        (
            "timeDuration",
            'duration("PT5S") * lap',
            'write = duration("PT5S") * lap, as FEEL does',
        ),
        ("timeDuration", "1000", "write it with its unit: PT1000S are seconds"),
        ("timeDuration", "R3/PT1S", "put it into a timeCycle"),
        (
            "timeDuration",
            "due.time",
            "write it as ISO 8601, such as PT30S; a name of the data is written ${due.time}",
        ),
        ("timeDuration", "time is a concept", "write it as ISO 8601, such as PT30S"),
        ("timeDuration", "9" * 10_000, "write it as ISO 8601, such as PT30S"),
        ("timeDate", "PT5M", "put it into a timeDuration"),
        ("timeCycle", "2s", "write R/PT2S, or R1/PT2S for once"),
        ("timeCycle", "500ms###1m", "write R/PT1M"),
    ],
)
def test_a_foreign_time_has_a_remedy(kind: str, text: str, remedy: str) -> None:
    assert time_remedy(kind, text) == remedy


def test_the_findings_carry_the_remedies() -> None:
    script = '<scriptTask id="T" scriptFormat="groovy"><script>x = 1;</script></scriptTask>'
    assert "'x = 1'" in findings(around(script))[0].remedy
    script = '<scriptTask id="T"><script>y = 2\nx = 1;</script></scriptTask>'
    assert findings(around(script))[0].remedy == "write 'x = 1'"
    condition = (
        '><conditionExpression language="java">return a;</conditionExpression></sequenceFlow>'
    )
    text = flow("S", "E").removesuffix("/>") + condition
    data = process(f'<startEvent id="S"/><endEvent id="E"/>{text}')
    assert findings(data)[0].remedy == "write a, without a language"
    timer = "<timerEventDefinition><timeDuration>2s</timeDuration></timerEventDefinition>"
    event = f'<intermediateCatchEvent id="T">{timer}</intermediateCatchEvent>'
    assert findings(around(event))[0].remedy == "write PT2S"
    end = '<endEvent id="T"><errorEventDefinition errorRef="E9"/></endEvent>'
    assert '<error id="E9"/>' in findings(around(end.replace('id="T"', 'id="E"')))[0].remedy


# --- who does the work of a service task --------------------------------------------------------

ENGINES = 'xmlns:activiti="http://activiti.org/bpmn" xmlns:flowable="http://flowable.org/bpmn"'
JOB = '<extensionElements><zeebe:taskDefinition type="wash"/></extensionElements>'


@pytest.mark.parametrize(
    "task",
    [
        '<serviceTask id="T" camunda:type="external" camunda:topic="wash"/>',
        f'<serviceTask id="T" {ENGINES} activiti:class="wash"/>',
        f'<serviceTask id="T" {ENGINES} flowable:class=" wash "/>',
        f'<serviceTask id="T">{JOB}</serviceTask>',
    ],
)
def test_names_of_services_of_other_engines_are_read(task: str) -> None:
    mission = load(around(task))
    (found,) = [node for node in mission.nodes if isinstance(node, ServiceTask)]
    assert found.call is not None
    assert found.call.service == "wash"
    assert mission.warnings == ()


def test_what_another_engine_would_do_is_named() -> None:
    (warning,) = findings(around('<serviceTask id="T" camunda:expression="${bean.go()}"/>'))
    assert warning.rule == "no-service"
    assert "(its expression '${bean.go()}' is another engine's)" in warning.message
