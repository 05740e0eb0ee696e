"""Rules of sequence flows and gateways (7.6.2, 8.4.9, 8.4.13, 10.6)."""

import pytest
from bpmn_text import findings
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# flow-into-start | T-S | start event 'S'
<task id="T"/>
*T
! [T>S]
~ id="T-S" sourceRef="T" targetRef="S" => id="T-S" sourceRef="T" targetRef="E"

# flow-into-boundary | S-B | boundary event 'B'
<task id="T"/><boundaryEvent id="B" attachedToRef="T"><errorEventDefinition/></boundaryEvent>[B>E]
*T
! [S>B]
~ id="S-B" sourceRef="S" targetRef="B" => id="S-B" sourceRef="S" targetRef="E"

# flow-out-of-end | E-T | end event 'E'
<task id="T"/>
*T
! [E>T]
~ id="E-T" sourceRef="E" => id="E-T" sourceRef="S"

# flow-crosses-border | S-x | process 'P'
<subProcess id="T"><task id="x"/></subProcess>
*T
! [S>x]
~ targetRef="x" => targetRef="T"

# dangling-reference | f | 'X'
*
! <sequenceFlow id="f" sourceRef="S" targetRef="X"/>
~ "X" => "E"

# condition-not-allowed | f | out of an event
<startEvent id="S"/><endEvent id="E"/>
! <sequenceFlow id="f" sourceRef="S" targetRef="E"><conditionExpression>a</conditionExpression>
</sequenceFlow>
~ <conditionExpression>a</conditionExpression> => <documentation/>

# condition-ignored | f | parallel
<startEvent id="S"/><endEvent id="E"/><parallelGateway id="G"/>[S>G][G>E]
! <sequenceFlow id="f" sourceRef="G" targetRef="E"><conditionExpression>a</conditionExpression>
</sequenceFlow>
~ parallelGateway => inclusiveGateway

# default-with-condition | f | default
<startEvent id="S"/><endEvent id="E"/><exclusiveGateway id="G" default="f"/>[S>G][G>E]
! <sequenceFlow id="f" sourceRef="G" targetRef="E"><conditionExpression>a</conditionExpression>
</sequenceFlow>
~ default="f" => default="G-E"

# default-not-own | T | 'S-T'
! <task id="T" default="S-T"/>
*T
~ "S-T"/> => "T-E"/>

# empty-condition | f | empty
<startEvent id="S"/><endEvent id="E"/><task id="T"/>[S>T][T>E]
<sequenceFlow id="f" sourceRef="T" targetRef="E">
! <conditionExpression/>
</sequenceFlow>
~ <conditionExpression/> => <conditionExpression>a</conditionExpression>

# lone-condition | f | the only flow
<startEvent id="S"/><endEvent id="E"/><task id="T"/>[S>T]
! <sequenceFlow id="f" sourceRef="T" targetRef="E"><conditionExpression>a</conditionExpression>
</sequenceFlow>
~ </sequenceFlow> => </sequenceFlow><sequenceFlow id="g" sourceRef="T" targetRef="E"/>

# immediate-false | f | isImmediate
*
! <sequenceFlow id="f" sourceRef="S" targetRef="E" isImmediate="false"/>
~ isImmediate="false" => isImmediate="true"

# listed-flow | S | 'f7'
<startEvent id="S">
! <outgoing>f7</outgoing>
</startEvent><endEvent id="E"/>[S>E]
~ f7 => S-E

# gateway-direction | G | 'Split'
! <startEvent id="S"/><endEvent id="E"/><parallelGateway id="G" gatewayDirection="Split"/>[S>G]
[G>E]<sequenceFlow id="f" sourceRef="G" targetRef="E"/>
~ "Split" => "Diverging"

# listed-flow-elsewhere | A | sourceRef of 'S-A' is 'S'
<task id="A">
! <outgoing>S-A</outgoing>
</task>
*A
~ <outgoing>S-A => <outgoing>A-E

# unlisted-flow | T | 'T-E'
! <task id="T"><outgoing>g</outgoing></task><sequenceFlow id="g" sourceRef="T" targetRef="E"/>
*T
~ <outgoing>g => <outgoing>T-E</outgoing><outgoing>g

# idle-gateway | G | neither
! <exclusiveGateway id="G"/>
*
~ <exclusiveGateway id="G"/> => <task id="G"/>

# idle-gateway | T | neither
! <inclusiveGateway id="T"/>
*T
~ <inclusiveGateway id="T"/> => <task id="T"/>

# not-converging | G | 1 incoming and 2 outgoing
! <startEvent id="S"/><endEvent id="E"/><parallelGateway id="G" gatewayDirection="Converging"/>[S>G]
[G>E]<sequenceFlow id="f" sourceRef="G" targetRef="E"/>
~ Converging => Diverging

# not-diverging | G | 2 incoming and 1 outgoing
! <startEvent id="S"/><endEvent id="E"/><parallelGateway id="G" gatewayDirection="Diverging"/>[S>G]
[G>E]<sequenceFlow id="f" sourceRef="S" targetRef="G"/>
~ Diverging => Converging

# not-mixed | G | 2 incoming and 1 outgoing
! <startEvent id="S"/><endEvent id="E"/><parallelGateway id="G" gatewayDirection="Mixed"/>[S>G]
[G>E]<sequenceFlow id="f" sourceRef="S" targetRef="G"/>
~ "Mixed" => "Unspecified"

# no-activation-condition | G | activationCondition
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <complexGateway id="G"></complexGateway>
[G>E]<sequenceFlow id="f" sourceRef="S" targetRef="G"/>
~ ></complex => ><activationCondition>activationCount >= 1</activationCondition></complex

# event-gateway-branches | G | this one has 1
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G"/>[G>A][A>E]
<receiveTask id="A" messageRef="m"/>
^ <message id="m"/>
~ sourceRef="G" targetRef="A"/> => sourceRef="G" targetRef="A"/>
~~ <sequenceFlow id="f" sourceRef="G" targetRef="B"/><receiveTask id="B" messageRef="m"/>

# event-gateway-target | G | 'B' is a task
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G"/>[G>A][A>E][G>B][B>E]
<receiveTask id="A" messageRef="m"/><task id="B"/>
^ <message id="m"/>
~ <task id="B"/> => <receiveTask id="B" messageRef="m"/>

# event-gateway-trigger | B | for a link event | link-catch-incoming
<startEvent id="S"/><endEvent id="E"/>[S>G]
<eventBasedGateway id="G"/>[G>A][A>E][G>B][B>E]<receiveTask id="A" messageRef="m"/>
! <intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
<intermediateThrowEvent id="C"><linkEventDefinition name="l"/></intermediateThrowEvent>
[S>C]
^ <message id="m"/><signal id="s"/>
~ <intermediateThrowEvent id="C">
~~ <linkEventDefinition name="l"/> => <intermediateThrowEvent id="C">
~~ <signalEventDefinition signalRef="s"/>
~ <linkEventDefinition name="l"/> => <signalEventDefinition signalRef="s"/>

# event-gateway-mixed | G | both
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G"/>[G>A][A>E][G>B][B>E]
<receiveTask id="A" messageRef="m"/>
<intermediateCatchEvent id="B"><messageEventDefinition messageRef="m"/></intermediateCatchEvent>
^ <message id="m"/><signal id="s"/>
~ messageEventDefinition messageRef="m" => signalEventDefinition signalRef="s"

# event-gateway-boundary | A | boundary events
<startEvent id="S"/><endEvent id="E"/>[S>G]
<eventBasedGateway id="G"/>[G>A][A>E][G>B][B>E]
! <receiveTask id="A" messageRef="m"/>
<receiveTask id="B" messageRef="m"/><task id="T"/>[S>T][T>E]
<boundaryEvent id="C" attachedToRef="A"><errorEventDefinition/></boundaryEvent>[C>E]
^ <message id="m"/>
~ attachedToRef="A" => attachedToRef="T"

# event-gateway-shared-target | A | another incoming flow
<startEvent id="S"/><endEvent id="E"/>[S>G]
<eventBasedGateway id="G"/>[G>A][A>E][G>B][B>E]
! <receiveTask id="A" messageRef="m"/>
<receiveTask id="B" messageRef="m"/>[S>A]
^ <message id="m"/>
~ id="S-A" sourceRef="S" targetRef="A" => id="S-A" sourceRef="S" targetRef="E"

# event-gateway-condition | f | condition
<startEvent id="S"/><endEvent id="E"/>[S>G]
<eventBasedGateway id="G"/>[G>A][A>E][B>E]
<receiveTask id="A" messageRef="m"/><receiveTask id="B" messageRef="m"/>
! <sequenceFlow id="f" sourceRef="G" targetRef="B"><conditionExpression>a</conditionExpression>
</sequenceFlow>
^ <message id="m"/>
~ <conditionExpression>a</conditionExpression> => <documentation/>

# parallel-event-gateway | G | all of its events
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G" eventGatewayType="Parallel"/>[G>A][A>E][G>B][B>E]
<receiveTask id="A" messageRef="m"/><receiveTask id="B" messageRef="m"/>
^ <message id="m"/>
~ "Parallel" => "Exclusive"

# event-gateway-begins | G | incoming flow
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G" instantiate="true"/>[G>A][A>E][G>B][B>E]
<receiveTask id="A" messageRef="m"/><receiveTask id="B" messageRef="m"/>
^ <message id="m"/>
~ "true"/> => "false"/>

# event-gateway-type | G | 'exclusive'
<startEvent id="S"/><endEvent id="E"/>[S>G]
! <eventBasedGateway id="G" eventGatewayType="exclusive"/>[G>A][A>E][G>B][B>E]
<receiveTask id="A" messageRef="m"/><receiveTask id="B" messageRef="m"/>
^ <message id="m"/>
~ "exclusive" => "Exclusive"
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)


def test_a_flow_may_lack_its_lists() -> None:
    (case,) = read_cases("""
# listed-flow | S | S-E
! <startEvent id="S"><outgoing>S-E</outgoing></startEvent><endEvent id="E"/>[S>E]
~ <outgoing>S-E</outgoing> => <documentation/>
""")
    assert findings(case.broken) == findings(case.kept) == ()
