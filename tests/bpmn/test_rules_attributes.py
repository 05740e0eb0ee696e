"""Rules of attributes' values, and of which elements stand where and how often (15.3)."""

import pytest
from bpmn_text import definitions, findings
from rule_cases import PLAIN, Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# bad-truth | D | isCollection is 'yes'
! <dataObject id="D" isCollection="yes"/>
*
~ "yes" => "true"

# bad-value | B | cancelActivity
<task id="T"/>
! <boundaryEvent id="B" attachedToRef="T" cancelActivity="no"><errorEventDefinition/>
</boundaryEvent>[B>E]
*T
~ "no" => "true"

# repeated-element | f | 'conditionExpression' in a sequence flow
<startEvent id="S"/><endEvent id="E"/><exclusiveGateway id="G"/>[S>G][G>E]
<sequenceFlow id="f" sourceRef="G" targetRef="E"><conditionExpression>a</conditionExpression>
! <conditionExpression>b</conditionExpression>
</sequenceFlow>
~ <conditionExpression>b</conditionExpression> =>

# element-order | T | after
<task id="T"><outgoing>T-E</outgoing>
! <incoming>S-T</incoming>
</task>
*T
~ <outgoing>T-E</outgoing> =>

# element-order | T | 'documentation' after 'inputSet'
<task id="T"><ioSpecification><inputSet/>
! <documentation/>
<outputSet/></ioSpecification></task>
*T
~ <documentation/> =>

# misspelled-attribute | T | 'nmae' for a task; it is ignored
! <task id="T" nmae="red"/>
*T
~ nmae => name

# unknown-attribute | T | 'colour'
! <task id="T" colour="red"/>
*T
~ colour => name

# unknown-attribute | T | 'max'
<task id="T">
! <standardLoopCharacteristics loopMaximum="3" max="3"/>
</task>
*T
~ max="3" =>

# unknown-element | T | 'extra'
<task id="T">
! <extra/>
</task>
*T
~ <extra/> =>

# unknown-element | q | 'pool' in a collaboration
^ <collaboration id="C"><participant id="p"/>
^! <pool id="q"/>
^ </collaboration>
~ pool => textAnnotation
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)


def test_a_misspelt_child_gets_the_near_match() -> None:
    (found,) = findings(
        definitions(
            f'<process id="P">{PLAIN}</process>'
            '<collaboration id="C"><partecipant id="p"/></collaboration>'
        )
    )
    assert found.remedy == "did you mean 'participant'?"


def test_what_stands_in_a_behavior_is_no_bpmn() -> None:
    script = (
        "<behavior><property name='type' value='vehicle'/><property name='name' value='hold'/>"
        "<resources><resource/></resources></behavior>"
    )
    data = definitions(
        f'<process id="P">{PLAIN}<scriptTask id="T" scriptFormat="text/xml"><script>{script}'
        "</script></scriptTask></process>"
    )
    assert "resource-name" not in {each.rule for each in findings(data)}
