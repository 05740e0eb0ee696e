"""Data as operators type it."""

import pytest

from m2pem.api.data_text import named_value
from m2pem.errors import OperatorError


def test_the_value_is_yaml() -> None:
    assert named_value("a.b = 3.5") == ("a.b", 3.5)
    assert named_value("a=x=y") == ("a", "x=y")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("3.5", "not of the form NAME=VALUE"),
        ("=1", "not of the form NAME=VALUE"),
        ("a=[1", "the value of a: "),
    ],
)
def test_what_is_no_value_is_refused_with_the_form(text: str, why: str) -> None:
    with pytest.raises(OperatorError, match=why):
        named_value(text)
