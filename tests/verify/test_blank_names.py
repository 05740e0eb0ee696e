"""An element whose name is blank or missing is called by its kind and id."""

import pytest

from m2pem.verify.report.run_steps import ElementNames
from tests.engine.notation import mission

MODEL = """<startEvent id="start"/> <exclusiveGateway id="which" name=" "/> <userTask id="u"/>
    start -> which -> u
"""


@pytest.mark.parametrize("name", [" ", "&#10;", "&#9; "])
def test_an_element_with_a_blank_name_is_called_by_its_kind_and_id(name: str) -> None:
    drawn = mission(MODEL.replace('name=" "', f'name="{name}"'))
    assert drawn.elements["which"].label == "exclusive gateway which"
    element_names = ElementNames(drawn)
    assert element_names.name("which") == "exclusive gateway which"
    assert element_names.name("f1") == "start → exclusive gateway which"


def test_an_element_without_a_name_is_called_by_its_kind_and_id_in_reports() -> None:
    drawn = mission(MODEL.replace('name=" "', ""))
    assert drawn.elements["which"].label == "which"
    element_names = ElementNames(drawn)
    assert (
        element_names.name("which") == element_names.with_id("which") == "exclusive gateway which"
    )


def test_kinds_are_called_what_bpmn_calls_them() -> None:
    drawn = mission("""<startEvent id="s"/> <subProcess id="inner"><task id="t"/></subProcess>
        <adHocSubProcess id="any"><task id="u"/></adHocSubProcess>
        <intermediateThrowEvent id="out"/> <endEvent id="e"/>
        s -> inner -> any -> out -> e
    """)
    kinds = [drawn.elements[each].kind for each in ("inner", "any", "out", "e")]
    assert kinds == ["subprocess", "ad-hoc subprocess", "intermediate throw event", "end event"]
