"""Rules of compensation (10.5.4, 10.5.5, 10.7)."""

import pytest
from bpmn_text import findings
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# compensation-boundary-flow | B | outgoing
<task id="T"/><task id="C" isForCompensation="true"/>
! <boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
<association id="a" sourceRef="B" targetRef="C"/>
[B>E]
*T
~ id="B-E" sourceRef="B" => id="B-E" sourceRef="S"

# compensation-boundary-not-interrupting | B | has completed
<task id="T"/><task id="C" isForCompensation="true"/>
! <boundaryEvent id="B" attachedToRef="T" cancelActivity="false"><compensateEventDefinition/>
</boundaryEvent>
<association id="a" sourceRef="B" targetRef="C"/>
*T
~ cancelActivity="false" => cancelActivity="true"

# compensated-activity | E | 'X'
<startEvent id="S"/><endEvent id="E">
! <compensateEventDefinition activityRef="X"/>
</endEvent>[S>T][T>E]<subProcess id="T"><task id="x"/></subProcess>
~ "X" => "T"

# compensated-elsewhere | E | 'x'
<startEvent id="S"/><endEvent id="E">
! <compensateEventDefinition activityRef="x"/>
</endEvent>[S>T][T>E]<subProcess id="T"><subProcess id="x"><task id="y"/></subProcess></subProcess>
~ "x"/> => "T"/>

# compensated-without-handler | E | 'T'
<startEvent id="S"/><endEvent id="E">
! <compensateEventDefinition activityRef="T"/>
</endEvent>[S>T][T>E]<task id="T"/><task id="C" isForCompensation="true"/>
<task id="U"/>[S>U]<association id="a" sourceRef="B" targetRef="C"/>
<boundaryEvent id="B" attachedToRef="U"><compensateEventDefinition/></boundaryEvent>
~ attachedToRef="U" => attachedToRef="T"

# compensation-catch-activity | B | must not name
<task id="T"/><task id="C" isForCompensation="true"/>
<boundaryEvent id="B" attachedToRef="T">
! <compensateEventDefinition activityRef="T"/>
</boundaryEvent><association id="a" sourceRef="B" targetRef="C"/>
*T
~ activityRef="T"/> => />

# handler-incoming | C | incoming
<task id="T"/><boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
! <task id="C" isForCompensation="true"/>
<association id="a" sourceRef="B" targetRef="C"/>
[S>C]
*T
~ id="S-C" sourceRef="S" targetRef="C" => id="S-C" sourceRef="S" targetRef="E"

# handler-outgoing | C | outgoing
<task id="T"/><boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
! <task id="C" isForCompensation="true"/>
<association id="a" sourceRef="B" targetRef="C"/>
[C>E]
*T
~ id="C-E" sourceRef="C" => id="C-E" sourceRef="S"

# handler-unused | C | no compensation boundary event
*
! <task id="C" isForCompensation="true"/>
~ isForCompensation="true"/> => isForCompensation="false"/>
~~ <sequenceFlow id="f" sourceRef="S" targetRef="C"/>

# compensation-without-handler | B | leads to no activity | handler-unused
<task id="T"/><task id="C" isForCompensation="true"/>
! <boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
*T
~ </boundaryEvent> => </boundaryEvent><association id="a" sourceRef="B" targetRef="C"/>

# two-handlers | B | 'C', 'D'
<task id="T"/>
! <boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
<task id="C" isForCompensation="true"/><task id="D" isForCompensation="true"/>
<task id="U"/>[S>U]
<boundaryEvent id="F" attachedToRef="U"><compensateEventDefinition/></boundaryEvent>
<association id="a" sourceRef="B" targetRef="C"/><association id="b" sourceRef="B" targetRef="D"/>
<association id="c" sourceRef="F" targetRef="D"/>
*T
~ <association id="b" sourceRef="B" targetRef="D"/> => <textAnnotation id="t"/>

# two-compensation-events | D | the first counts
<task id="T"/><task id="U"/>[S>U]<task id="C" isForCompensation="true"/>
<boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
! <boundaryEvent id="D" attachedToRef="T"><compensateEventDefinition /></boundaryEvent>
<association id="a" sourceRef="B" targetRef="C"/><association id="b" sourceRef="D" targetRef="C"/>
*T
~ id="D" attachedToRef="T" => id="D" attachedToRef="tns:U"

# handler-not-marked | C | not marked | unreachable
<task id="T"/><boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
! <task id="C"/>
<association id="a" sourceRef="B" targetRef="C"/>
*T
~ id="C"/> => id="C" isForCompensation="true"/>

# handler-elsewhere | C | 'B' leads to it
<task id="T"/><boundaryEvent id="B" attachedToRef="T"><compensateEventDefinition/></boundaryEvent>
<subProcess id="X"><task id="x"/>
! <task id="C" isForCompensation="true"/>
</subProcess>[S>X]
<task id="D" isForCompensation="true"/>
<association id="a" sourceRef="B" targetRef="C"/><association id="b" sourceRef="F" targetRef="D"/>
<task id="U"/>[S>U]
<boundaryEvent id="F" attachedToRef="U"><compensateEventDefinition/></boundaryEvent>
*T
~ targetRef="C" => targetRef="D"
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)


def test_a_compensation_event_subprocess_needs_no_association() -> None:
    (case,) = read_cases("""
# handler-unused | X | no compensation boundary event
<subProcess id="T"><task id="x"/>
! <subProcess id="X" triggeredByEvent="true" isForCompensation="true">
<startEvent id="y"><compensateEventDefinition/></startEvent><endEvent id="z"/>[y>z]</subProcess>
</subProcess>
*T
~ isForCompensation="true" => name="X"
""")
    assert "handler-unused" not in {each.rule for each in findings(case.broken)}
