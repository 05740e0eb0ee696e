"""What the editor shows of the dialects is what they read."""

import pytest

from m2pem.mission.expression import Dialect, parse
from m2pem.mission.expression.described import expression_dialects
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import FUNCTIONS, XPATH_FUNCTIONS

FOUND = expression_dialects()
MARKS = {Dialect.FEEL: "= {}", Dialect.JUEL: "${{{}}}"}
SIGNATURES = [
    (dialect, signature)
    for dialect, words in FOUND.items()
    for function in words.functions
    for signature in function.signatures
]


def call(signature: str) -> str:
    """A call with the arguments that may not be left out."""
    name, _, rest = signature.partition("(")
    parameters = [each for each in rest.rstrip(")").split(", ") if each]
    given = [
        "a.b" if name != "getDataObject" else "'a.b'" for each in parameters if each[-1] not in "?."
    ]
    return f"{name}({', '.join(given)})"


@pytest.mark.parametrize(("dialect", "signature"), SIGNATURES)
def test_every_signature_can_be_called(dialect: Dialect, signature: str) -> None:
    read = parse(MARKS.get(dialect, "{}").format(call(signature)), str(dialect))
    assert read.dialect is dialect


def test_every_function_is_there_with_a_description() -> None:
    names = {dialect: {each.name for each in FOUND[dialect].functions} for dialect in FOUND}
    assert names[Dialect.BARE] == names[Dialect.JUEL] == {*FUNCTIONS, "now"}
    assert names[Dialect.XPATH] >= {*FUNCTIONS, *XPATH_FUNCTIONS}
    assert names[Dialect.FEEL] == {*FUNCTIONS, *FEEL_FUNCTIONS, "now", "today", "not"} - {"@"}
    assert all(each.doc for words in FOUND.values() for each in words.functions)


@pytest.mark.parametrize("dialect", FOUND)
def test_every_operator_is_read_between_two_values(dialect: Dialect) -> None:
    for operator in FOUND[dialect].operators:
        right = "[2]" if operator == "in" else "2"
        parse(MARKS.get(dialect, "{}").format(f"1 {operator} {right}"), str(dialect))
