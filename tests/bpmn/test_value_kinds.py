"""What `check` says of expressions whose kinds of values do not go together."""

import random
from collections.abc import Mapping
from xml.sax.saxutils import escape

import pytest

from m2pem.bpmn import parse_mission
from m2pem.bpmn.lint import lint
from m2pem.bpmn.value_kinds import doubts
from m2pem.errors import ExpressionError, ExpressionSyntaxError
from m2pem.mission.expression import parse
from m2pem.mission.expression.kinds import DATA, kinds
from m2pem.mission.expression.operators import kind
from m2pem.mission.expression.vocabulary import COERCING
from m2pem.scripting.checking import check
from tests.bpmn.bpmn_text import definitions

KINDS = {
    "lap": frozenset({"number"}),
    "answer": frozenset({"text"}),
    "armed": frozenset({"boolean"}),
    "areas": frozenset({"list"}),
    "either": frozenset({"text", "number"}),
}
"""`other` may be anything."""


def found(text: str, language: str | None = None) -> list[tuple[str, str]]:
    return [(rule.slug, said) for rule, said, _ in doubts(parse(text, language), _kinds_of)]


def _kinds_of(name: str) -> frozenset[str]:
    return KINDS.get(name, DATA)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("lap == '3'", "'==' of a number and a text is an error"),
        ("answer < 4 and armed", "'<' of a text and a number is an error"),
        ("'lap ' + lap", "'+' of a text and a number is an error"),
        ("= lap < answer", "'<' of a number and a text has no value"),
        ('= armed = "true"', "'==' of a boolean and a text has no value"),
        ("= answer + 1 > 2", "'+' of a text and a number has no value"),
        (
            "${answer < 40}",
            "'<' of a text and a number has another value than in earlier versions: JUEL",
        ),
        ("${armed == 'true'}", "'==' of a boolean and a text has another value"),
        ("${answer + '2'}", "'+' of a text and a text has another value"),
        ("${either > 3}", "'>' of a number or a text and a number has another value"),
    ],
)
def test_kinds_that_do_not_go_together_are_named_with_the_operator(text: str, said: str) -> None:
    ((_, message),) = found(text)
    assert said in message
    assert text in message


@pytest.mark.parametrize(
    "text",
    [
        "lap == 3 and answer == 'go' and armed == true",
        "armed == 1",
        "either == 3",
        "other < 3 and other == 'x'",
        "answer == null",
        "text(lap) == '3'",
        "= lap = 3 and answer = null",
        "= either < 3",
        '= some lap in areas satisfies lap = "north"',
        "${answer == 'go' && lap > 2 && other < 40}",
        "${answer + 1 > lap}",
    ],
)
def test_what_may_be_right_raises_no_doubt(text: str) -> None:
    assert found(text) == []


def test_check_knows_what_scripts_loops_and_operators_write() -> None:
    def lint_of(condition: str) -> Mapping[str, str]:
        mission = parse_mission(
            definitions(
                '<process id="P"><startEvent id="S"/>'
                '<sequenceFlow id="f" sourceRef="S" targetRef="A"/>'
                '<scriptTask id="A" scriptFormat="m2pem">'
                '<script>lap = 1\nnote = "x"</script></scriptTask>'
                '<sequenceFlow id="g" sourceRef="A" targetRef="U"/><userTask id="U"/>'
                '<sequenceFlow id="h" sourceRef="U" targetRef="G"/>'
                '<exclusiveGateway id="G" default="j"/>'
                '<sequenceFlow id="i" sourceRef="G" targetRef="E">'
                f"<conditionExpression>{condition}</conditionExpression></sequenceFlow>"
                '<sequenceFlow id="j" sourceRef="G" targetRef="E"/><endEvent id="E"/></process>'
            ),
            "m.bpmn",
        )
        return {each.rule: each.message for each in lint(mission)}

    assert "'==' of a number and a text" in lint_of("lap == 'x'")["mixed-kinds"]
    assert "'==' of a text and a number" in lint_of("user.decision == 1")["mixed-kinds"]
    assert "other-value" in lint_of("${note == 1}")
    assert not lint_of("lap == 1 and note == 'x'")


@pytest.mark.parametrize(
    ("structure", "condition", "said"),
    [
        ("xsd:int", "level == 'x'", "'==' of a number and a text"),
        ("java.lang.String", "level > 3", "'>' of a text and a number"),
        ("xsd:boolean", "${level == 'true'}", "'==' of a boolean and a text"),
        ("tns:Level", "level == 'x'", ""),
    ],
)
def test_check_knows_what_data_objects_hold(structure: str, condition: str, said: str) -> None:
    mission = parse_mission(
        definitions(
            f'<itemDefinition id="item" structureRef="{structure}"/>'
            '<process id="P"><dataObject id="d" name="level" itemSubjectRef="item"/>'
            '<startEvent id="S"/><sequenceFlow id="f" sourceRef="S" targetRef="G"/>'
            '<exclusiveGateway id="G" default="j"/>'
            '<sequenceFlow id="i" sourceRef="G" targetRef="E"><conditionExpression>'
            f"{escape(condition)}</conditionExpression></sequenceFlow>"
            '<sequenceFlow id="j" sourceRef="G" targetRef="E"/><endEvent id="E"/></process>'
        ),
        "m.bpmn",
    )
    rules = ("mixed-kinds", "other-value")
    found = [each.message for each in lint(mission) if each.rule in rules]
    assert len(found) == bool(said)
    assert all(said in each for each in found)


def test_check_knows_the_kinds_of_what_the_mission_starts_with() -> None:
    mission = parse_mission(
        definitions(
            '<process id="P"><startEvent id="S"/><sequenceFlow id="f" sourceRef="S" targetRef="G"/>'
            '<exclusiveGateway id="G" default="j"/>'
            '<sequenceFlow id="i" sourceRef="G" targetRef="E"><conditionExpression>level &gt; 3'
            "</conditionExpression></sequenceFlow>"
            '<sequenceFlow id="j" sourceRef="G" targetRef="E"/><endEvent id="E"/></process>'
        ),
        "m.bpmn",
    )
    (found,) = check(mission, data={"level": "high"})
    assert (found.rule, found.element) == ("mixed-kinds", "i")
    assert "'>' of a text and a number" in found.message
    for given in (4, None):
        assert not check(mission, data={"level": given})
    assert not lint(mission, ["level"])


VALUES = {
    "lap": [0, 3, -2.5],
    "answer": ["", "3", "go", "true"],
    "armed": [True, False],
    "areas": [[], ["north", 2]],
    "either": [4, "4"],
    "other": [None, 1, "x", True, [1]],
}
DIALECTS = {
    "m2pem": (("==", "!=", "<", "<=", "+", "-", "*", "/"), "{}"),
    "juel": (("==", "!=", "<", ">=", "+", "-", "*", "/", "%"), "${{{}}}"),
    "FEEL": (("=", "!=", "<", ">", "+", "-", "*", "/"), "= {}"),
    "http://www.w3.org/1999/XPath": (("=", "!=", "<", "+", "-", "*"), "{}"),
}


@pytest.mark.parametrize("language", DIALECTS)
def test_random_expressions_have_no_other_kind_and_no_value_where_that_is_said(
    language: str,
) -> None:
    dice, (signs, form) = random.Random(7), DIALECTS[language]
    atoms = [*VALUES, "1", "2.5", "'go'", "'3'", "true()" if "XPath" in language else "true"]
    said = 0
    for _ in range(1_000):
        text = f"{dice.choice(atoms)} {dice.choice(signs)} {dice.choice(atoms)}"
        if dice.random() < 0.5:
            outer = [each for each in signs if each in "+-*/%"]  # the others take null
            text = f"({text}) {dice.choice(outer)} {dice.choice(atoms)}"
        text = form.format(text.replace("'", '"') if language == "FEEL" else text)
        try:
            expression = parse(text, language)
        except ExpressionSyntaxError:
            continue
        possible = kinds(expression.tree, coerced=expression.dialect in COERCING, of=_kinds_of)
        never = [rule for rule, _ in found(text, language) if rule == "mixed-kinds"]
        said += bool(never)
        for _ in range(8):
            data = {name: dice.choice(values) for name, values in VALUES.items()}
            try:
                value = expression.evaluate(data.get)
            except ExpressionError:
                continue
            assert value is None or not never, (text, data, value)
            assert value is None or kind(value) in possible, (text, data, value, possible)
    assert said > 20 or "FEEL" not in language
