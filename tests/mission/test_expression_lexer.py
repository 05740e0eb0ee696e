"""How a text is taken apart, where one pattern does not say it all."""

import pytest

from m2pem.errors import ExpressionSyntaxError
from m2pem.mission.expression.dialect import Dialect
from m2pem.mission.expression.lexer import tokenize


def tokens(text: str, dialect: Dialect = Dialect.BARE) -> list[tuple[str, str, int]]:
    found = tokenize(text, slice(0, len(text)), dialect)
    return [token[:3] for token in found]


@pytest.mark.parametrize(
    "name", ["höhe", "höhe.x", "x.höhe", "a1.é2._", "hohe\u0301", "名前", "x\u00b7y", "π"]
)
def test_names_have_letters_of_any_script(name):
    assert tokens(f"1+{name}<2") == [
        ("number", "1", 0),
        ("+", "+", 1),
        ("name", name, 2),
        ("<", "<", 2 + len(name)),
        ("number", "2", 3 + len(name)),
        ("end", "the end", 4 + len(name)),
    ]


def test_words_keep_their_meaning_beside_characters_beyond_ascii():
    assert tokens("not\N{NO-BREAK SPACE}é\N{EM SPACE}and\N{NO-BREAK SPACE}true") == [
        ("not", "not", 0),
        ("name", "é", 4),
        ("and", "and", 6),
        ("constant", "true", 10),
        ("end", "the end", 14),
    ]


@pytest.mark.parametrize(
    ("text", "position", "message"),
    [
        ("a + b.", 5, "a part of the name is missing after '.'"),
        ("a + é.", 5, "a part of the name is missing after '.'"),
        ("not.", 3, "a part of the name is missing after '.'"),
        ("1 + 2x", 5, "a number cannot be followed by 'x'"),
        ("1 + .5.", 6, "a number cannot be followed by '.'"),
        ("12é", 2, "a number cannot be followed by 'é'"),
        ("1..2", 1, "a number cannot be followed by '.'"),
        ("a²", 1, "unexpected '²'"),
        ("a + 'b", 4, "the text is not closed by '"),
        ("a + 'b\\'", 4, "the text is not closed by '"),
        ("a + 'b\\x'", 4, r"'\x' is no escape"),
        ("a = 1", 2, "write '=='"),
        ("a  %b", 3, "write mod"),
    ],
)
def test_what_is_no_token_is_said_with_its_place(text, position, message):
    with pytest.raises(ExpressionSyntaxError) as caught:
        tokens(text)
    assert message in str(caught.value)
    assert caught.value.position == position


def test_xpath_names_before_a_bracket_are_functions_but_for_operators():
    assert [token[:2] for token in tokens("true() and (ns:a-b (x))", Dialect.XPATH)] == [
        ("name", "true"),
        ("(", "("),
        (")", ")"),
        ("and", "and"),
        ("(", "("),
        ("name", "ns:a-b"),
        ("(", "("),
        ("name", "x"),
        (")", ")"),
        (")", ")"),
        ("end", "the end"),
    ]


def test_the_end_is_where_the_span_ends():
    assert tokenize("a  }", slice(0, 3), Dialect.JUEL)[-1][2] == 3
