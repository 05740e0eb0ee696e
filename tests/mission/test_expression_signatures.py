"""What is read of the signature of an expression's function."""

import pytest

from m2pem.errors import ExpressionError
from m2pem.mission.expression.feel_functions import FEEL_FUNCTIONS
from m2pem.mission.expression.functions import LISTED
from m2pem.mission.expression.signatures import Function, Parameter
from m2pem.mission.expression.temporal import DAYS, MONTHS

FUNCTIONS = Function.table(
    [
        ("join(first: text, other?: text|number, ...) -> text", "".join, "all of them"),
        ("age(of: duration)", len, "how long it is"),
        ("same(a, b) -> boolean", lambda a, b: a == b, "whether they are the same"),
        ("same(a: list) -> boolean", lambda a: len({*a}) < 2, "whether all items are"),
    ]
)


def test_parameters_have_names_and_kinds_and_may_be_left_out() -> None:
    join = FUNCTIONS["join"]
    assert join.parameters == (
        Parameter("first", ("text",)),
        Parameter("other", ("text", "number"), optional=True),
    )
    assert (join.gives, join.doc, join.repeated) == (("text",), "all of them", True)
    assert [count for count in range(4) if join.accepts(count)] == [1, 2, 3]
    assert FUNCTIONS["age"].parameters == (Parameter("of", (DAYS, MONTHS)),)
    assert FUNCTIONS["age"].gives == ()


def test_a_signature_is_shown_without_kinds() -> None:
    assert FUNCTIONS["join"].signature == "join(first, other?, ...)"


def test_a_name_that_comes_again_is_another_way_to_call_the_function() -> None:
    assert [each.signature for each in FUNCTIONS["same"].ways] == ["same(a, b)", "same(a)"]
    assert FUNCTIONS["same"].doc == "whether they are the same"


def test_an_argument_of_another_kind_is_an_error_and_null_gives_null() -> None:
    assert FUNCTIONS["same"].call([None, None]) is True
    assert FUNCTIONS["age"].call([None]) is None
    with pytest.raises(ExpressionError, match=r"join\(\) takes a text, not the number 3"):
        FUNCTIONS["join"].call([3])


def test_arguments_fit_by_the_kinds_that_they_may_have() -> None:
    assert FUNCTIONS["join"].fits([frozenset({"text", "number"}), frozenset({"number"})])
    assert not FUNCTIONS["join"].fits([frozenset({"number"})])
    assert FUNCTIONS["same"].fits([frozenset(), frozenset({"map"})])


def test_only_a_function_of_one_list_takes_its_items_as_arguments() -> None:
    assert FEEL_FUNCTIONS["sum"].call([1, 2]) == 3
    assert FEEL_FUNCTIONS["append"].call([[1], 2, 3]) == [1, 2, 3]
    assert FEEL_FUNCTIONS["concatenate"].call([[1], [2]]) == [1, 2]


def test_every_function_says_what_it_gives() -> None:
    assert [name for name, each in LISTED.items() if not each.doc and "/" not in name] == ["FEEL @"]
