"""An element whose name is blank is called by its kind and id."""

import pytest

from m2pem.verify.report.words import Words
from tests.engine.notation import mission

MODEL = """<startEvent id="start"/> <exclusiveGateway id="which" name=" "/> <userTask id="u"/>
    start -> which -> u
"""


@pytest.mark.parametrize("name", [" ", "&#10;", "&#9; "])
def test_an_element_with_a_blank_name_is_called_by_its_kind_and_id(name: str) -> None:
    drawn = mission(MODEL.replace('name=" "', f'name="{name}"'))
    assert drawn.elements["which"].label == "exclusive gateway which"
    words = Words(drawn)
    assert words.name("which") == "exclusive gateway which"
    assert words.name("f1") == "start → exclusive gateway which"


def test_an_element_without_a_name_is_called_by_its_id() -> None:
    drawn = mission(MODEL.replace('name=" "', ""))
    assert drawn.elements["which"].label == "which"
    assert Words(drawn).name("which") == "which"
