"""Assignment scripts."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from m2pem.mission.behavior import Assignment, Script, ThrowError
from m2pem.mission.expression import parse
from m2pem.mission.script import parse_script


def test_statements_are_read_in_order_with_their_lines():
    text = "\n# set up\nlap.x = lap.x + 1\r\n\n  done=lap>3 # enough\nthrow  error  BAD-1\n"
    script, problems = parse_script(text, 40)
    assert problems == []
    assert script == Script(
        (
            Assignment("lap.x", parse("lap.x + 1"), 42),
            Assignment("done", parse("lap>3"), 44),
            ThrowError("BAD-1", 45),
        )
    )


@pytest.mark.parametrize("text", ["", "\n\n", "  # only a comment", "\r\n"])
def test_a_script_may_say_nothing(text):
    assert parse_script(text) == (Script(()), [])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x = 'a # b'  # c", "a # b"),
        (r"x = 'it\'s # 1' # '", "it's # 1"),
        ('x = "# = \'"', "# = '"),
        ("x = 1 == 1", True),
        ("x = [1, 'a=b']", [1, "a=b"]),
    ],
)
def test_marks_inside_quotes_are_text(text, value):
    script, problems = parse_script(text)
    assert problems == []
    assert script.statements[0].expression.evaluate(lambda name: None) == value


@pytest.mark.parametrize("key", ["throw", "throw.error", "größe", "a.1", "_", "some"])
def test_any_name_that_can_be_read_can_be_written(key):
    script, problems = parse_script(f"{key} = {key}")
    assert problems == []
    assert script.statements[0].key == key
    assert script.statements[0].expression.names == {key}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("print('x')", "\"print('x')\" is no statement; write 'name = expression' or"),
        ("x", "'x' is no statement"),
        ("x == 1", "'x == 1' is no statement"),
        ("x += 1", "'x += 1' is no statement"),
        ("1x = 1", "'1x = 1' is no statement"),
        ("x-y = 1", "'x-y = 1' is no statement"),
        ("x. = 1", "'x. = 1' is no statement"),
        ("a b = 1", "'a b = 1' is no statement"),
        ("x[0] = 1", "'x[0] = 1' is no statement"),
        ("= 1", "'= 1' is no statement"),
        ("throw", "'throw' is no statement"),
        ("throw BAD", "is no statement"),
        ("throw error", "is no statement"),
        ("throw error A B", "is no statement"),
        ("throw error 'BAD'", "is no error code"),
        ("throw error BAD;", "is no error code"),
        ("true = 1", "'true' is a word of the language"),
        ("in = 1", "'in' is a word of the language"),
        ("x =", "an expression is missing"),
        ("x = # nothing", "an expression is missing"),
        ("x = 1 +", "expected a value, found the end"),
        ("x = y = 1", "write '=='"),
        ("x = 1; y = 2", "unexpected ';'"),
        ("x = ${y}", "without '${' and '}'"),
        ("x = 'open", "is not closed"),
    ],
)
def test_any_other_line_is_refused(line, message):
    script, problems = parse_script(line)
    assert script.statements == ()
    [(number, problem)] = problems
    assert number == 1
    assert message in problem


def test_every_bad_line_is_named_and_the_good_ones_are_kept():
    script, problems = parse_script("a = 1\nimport os\nb = 2\nc = (\nos.system('x')", 7)
    assert [each.line for each in script.statements] == [7, 9]
    assert [number for number, _ in problems] == [8, 10, 11]


def test_messages_about_long_lines_are_short():
    _, [(_, problem)] = parse_script("x" * 100_000)
    assert len(problem) < 200


@settings(max_examples=200, deadline=None)
@given(st.text() | st.text(st.sampled_from("ab.=# '\"\\\n+1throw error")))
def test_reading_never_raises_and_accounts_for_every_line(text):
    script, problems = parse_script(text, 1)
    lines = [each.line for each in script.statements] + [number for number, _ in problems]
    assert len(set(lines)) == len(lines)
    assert all(1 <= line <= text.count("\n") + 1 for line in lines)
