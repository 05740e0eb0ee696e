"""Rules of events: triggers by position, flows, definitions, links, cancellation (10.5)."""

import pytest
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# intermediate-without-incoming | I | when its process begins | end-without-start
! <intermediateThrowEvent id="I"/>[I>E]
<endEvent id="E"/>
~ <endEvent id="E"/> => <endEvent id="E"/><startEvent id="S"/>
~~ <sequenceFlow id="s" sourceRef="S" targetRef="I"/>

# subprocess-starts | T | this one has 2
! <subProcess id="T"><startEvent id="a"/><startEvent id="b"/><endEvent id="z"/>[a>z][b>z]
</subProcess>
*T
~ <startEvent id="b"/> => <task id="b"/>

# compensation-not-interrupting | Z | cannot be non-interrupting
<subProcess id="T"><startEvent id="s"/><endEvent id="e"/>[s>e]
<subProcess id="H" triggeredByEvent="true">
! <startEvent id="Z" isInterrupting="false"><compensateEventDefinition/></startEvent>
<endEvent id="z"/>[Z>z]</subProcess></subProcess>
*T
~ "false" => "true"

# start-trigger | S | an error event
! <startEvent id="S"><errorEventDefinition/></startEvent><endEvent id="E"/>[S>E]
~ <errorEventDefinition/> => <documentation/>

# event-subprocess-start-trigger | x | a terminate event
*
<subProcess id="X" triggeredByEvent="true">
! <startEvent id="x"><terminateEventDefinition/></startEvent>
<endEvent id="y"/>[x>y]</subProcess>
~ <terminateEventDefinition/> => <errorEventDefinition/>

# end-result | E | a timer event
<startEvent id="S"/>[S>E]
! <endEvent id="E"><timerEventDefinition><timeDuration>PT1S</timeDuration></timerEventDefinition>
</endEvent>
~ <timerEventDefinition><timeDuration>PT1S</timeDuration>
~~ </timerEventDefinition> => <terminateEventDefinition/>

# end-result | E | a timer event
<startEvent id="S"/>[S>E]
! <endEvent id="E"><eventDefinitionRef>t</eventDefinitionRef></endEvent>
^ <timerEventDefinition id="t"><timeDuration>PT1S</timeDuration></timerEventDefinition>
^ <terminateEventDefinition id="u"/>
~ >t< => >u<

# catch-trigger | T | an escalation event
! <intermediateCatchEvent id="T"><escalationEventDefinition escalationRef="e"/>
</intermediateCatchEvent>
*T
^ <escalation id="e" escalationCode="1"/><signal id="s"/>
~ <escalationEventDefinition escalationRef="e"/> => <signalEventDefinition signalRef="s"/>

# throw-result | T | an error event
! <intermediateThrowEvent id="T"><errorEventDefinition/></intermediateThrowEvent>
*T
~ <errorEventDefinition/> => <documentation/>

# boundary-trigger | B | a link event
<task id="T"/>
! <boundaryEvent id="B" attachedToRef="T"><linkEventDefinition name="l"/></boundaryEvent>
[B>E]
*T
^ <error id="e"/>
~ <linkEventDefinition name="l"/> => <errorEventDefinition errorRef="e"/>

# no-trigger | T | what it waits for
! <intermediateCatchEvent id="T"></intermediateCatchEvent>
*T
^ <signal id="s"/>
~ "T"></inter => "T"><signalEventDefinition signalRef="s"/></inter

# error-not-interrupting | B | already failed
<task id="T"/>
! <boundaryEvent id="B" attachedToRef="T" cancelActivity="false"><errorEventDefinition/>
</boundaryEvent>[B>E]
*T
~ "false" => "true"

# error-not-interrupting | x | a start event
*
<subProcess id="X" triggeredByEvent="true">
! <startEvent id="x" isInterrupting="false"><errorEventDefinition/></startEvent>
<endEvent id="y"/>[x>y]</subProcess>
~ "false" => "true"

# no-trigger | x | what it waits for
*
<subProcess id="X" triggeredByEvent="true">
! <startEvent id="x"></startEvent>
<endEvent id="y"/>[x>y]</subProcess>
~ id="x"> => id="x"><errorEventDefinition/>

# not-interrupting-elsewhere | S | no meaning
! <startEvent id="S" isInterrupting="false"/>
<endEvent id="E"/>[S>E]
~ "false" => "true"

# parallel-multiple | T | this one has 1
! <intermediateCatchEvent id="T" parallelMultiple="true"><signalEventDefinition signalRef="s"/>
</intermediateCatchEvent>
*T
^ <signal id="s"/>
~ "true" => "false"

# start-without-end | P | no end event
<startEvent id="S"/><task id="T"/>[S>T]
~ <task id="T"/> => <endEvent id="T"/>

# end-without-start | P | no start event
<task id="T"/><endEvent id="E"/>[T>E]
~ <task id="T"/> => <startEvent id="T"/>

# start-without-flow | Z | start event
*
! <startEvent id="Z"/>
~ "Z"/> => "Z"/><sequenceFlow id="f" sourceRef="Z" targetRef="E"/>

# intermediate-without-flow | T | intermediate event
<startEvent id="S"/><endEvent id="E"/>[S>T][S>E]
! <intermediateThrowEvent id="T"/>
~ "T"/> => "T"/><sequenceFlow id="f" sourceRef="T" targetRef="E"/>

# intermediate-without-flow | T | intermediate event
<startEvent id="S"/><endEvent id="E"/>[S>T][S>E]
! <intermediateCatchEvent id="T"><signalEventDefinition signalRef="s"/></intermediateCatchEvent>
^ <signal id="s"/>
~ </intermediateCatchEvent> => </intermediateCatchEvent>
~~ <sequenceFlow id="f" sourceRef="T" targetRef="E"/>

# boundary-without-flow | B | boundary event
<task id="T"/>
! <boundaryEvent id="B" attachedToRef="T"><errorEventDefinition/></boundaryEvent>
*T
~ </boundaryEvent> => </boundaryEvent><sequenceFlow id="f" sourceRef="B" targetRef="E"/>

# bad-attachment | B | 'x'
<subProcess id="T"><task id="x"/></subProcess>
! <boundaryEvent id="B" attachedToRef="x"><errorEventDefinition/></boundaryEvent>
[B>E]
*T
~ attachedToRef="x" => attachedToRef="T"

# timer-time | T | no time
<intermediateCatchEvent id="T">
! <timerEventDefinition></timerEventDefinition>
</intermediateCatchEvent>
*T
~ ></timer => ><timeDuration>PT1S</timeDuration></timer

# missing-reference | T | no signal
! <intermediateThrowEvent id="T"><signalEventDefinition/></intermediateThrowEvent>
*T
^ <signal id="s"/>
~ <signalEventDefinition/> => <signalEventDefinition signalRef="s"/>

# thrown-error-code | E | 'e'
<startEvent id="S"/><endEvent id="E">
! <errorEventDefinition errorRef="e"/>
</endEvent>[S>E]
^ <error id="e"/>
~ <error id="e"/> => <error id="e" errorCode="7"/>

# thrown-escalation-code | T | 'e'
<intermediateThrowEvent id="T">
! <escalationEventDefinition escalationRef="e"/>
</intermediateThrowEvent>
*T
^ <escalation id="e"/>
~ <escalation id="e"/> => <escalation id="e" escalationCode="7"/>

# no-condition | T | no condition
<intermediateCatchEvent id="T">
! <conditionalEventDefinition></conditionalEventDefinition>
</intermediateCatchEvent>
*T
~ ></conditional => ><condition>a</condition></conditional

# event-operation | T | 'p'
<intermediateThrowEvent id="T"><messageEventDefinition messageRef="m">
! <operationRef>p</operationRef>
</messageEventDefinition></intermediateThrowEvent>
*T
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ >p< => >o<

# link-name | A | no name
<startEvent id="S"/><endEvent id="E"/>[S>A][B>E]
! <intermediateThrowEvent id="A">
<linkEventDefinition/>
</intermediateThrowEvent>
<intermediateThrowEvent id="C"><linkEventDefinition name="l"/></intermediateThrowEvent>[S>C]
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
~ <linkEventDefinition/> => <linkEventDefinition name="l"/>

# dangling-link | A | 'k'
<startEvent id="S"/><endEvent id="E"/>[S>A][B>E][S>C]
! <intermediateThrowEvent id="A"><linkEventDefinition name="k"/></intermediateThrowEvent>
<intermediateThrowEvent id="C"><linkEventDefinition name="l"/></intermediateThrowEvent>
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
~ "k" => "l"

# duplicate-link | D | 'B'
<startEvent id="S"/><endEvent id="E"/>[S>A][B>E][D>E][S>C]
<intermediateThrowEvent id="A"><linkEventDefinition name="l"/></intermediateThrowEvent>
<intermediateThrowEvent id="C"><linkEventDefinition name="k"/></intermediateThrowEvent>
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
! <intermediateCatchEvent id="D"><linkEventDefinition name="l" /></intermediateCatchEvent>
<intermediateCatchEvent id="F"><linkEventDefinition name="k"/></intermediateCatchEvent>[F>E]
~ <linkEventDefinition name="l" /> => <signalEventDefinition signalRef="s"/>
^ <signal id="s"/>

# link-throw-outgoing | A-E | out of
<startEvent id="S"/><endEvent id="E"/>[S>A][B>E]
<intermediateThrowEvent id="A"><linkEventDefinition name="l"/></intermediateThrowEvent>
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
! [A>E]
~ id="A-E" sourceRef="A" => id="A-E" sourceRef="B"

# link-catch-incoming | S-B | into
<startEvent id="S"/><endEvent id="E"/>[S>A][B>E]
<intermediateThrowEvent id="A"><linkEventDefinition name="l"/></intermediateThrowEvent>
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
! [S>B]
~ id="S-B" sourceRef="S" targetRef="B" => id="S-B" sourceRef="S" targetRef="E"

# link-crosses-border | A | 'B' is in another
<startEvent id="S"/><endEvent id="E"/>[S>A][S>T][T>E]
! <intermediateThrowEvent id="A"><linkEventDefinition name="l"/></intermediateThrowEvent>
<subProcess id="T"><task id="y"/>[B>y]
<intermediateCatchEvent id="B"><linkEventDefinition name="l"/></intermediateCatchEvent>
<intermediateThrowEvent id="C"><linkEventDefinition name="l"/></intermediateThrowEvent>[y>C]
</subProcess>
~ id="A"><linkEventDefinition name="l"/> => id="A"><documentation/>

# cancel-end-place | y | only in a transaction
! <subProcess id="T"><startEvent id="x"/><endEvent id="y"><cancelEventDefinition/></endEvent>[x>y]
</subProcess>
*T
~ subProcess => transaction

# cancel-uncaught | y | no boundary event
<transaction id="T"><startEvent id="x"/>
! <endEvent id="y"><cancelEventDefinition/></endEvent>
[x>y]</transaction><transaction id="U"><task id="z"/></transaction>[S>U]
<boundaryEvent id="B" attachedToRef="U"><cancelEventDefinition/></boundaryEvent>[B>E]
*T
~ attachedToRef="U" => attachedToRef="T"

# cancel-boundary-place | B | only to a transaction
<subProcess id="T"><task id="x"/></subProcess>
! <boundaryEvent id="B" attachedToRef="T"><cancelEventDefinition/></boundaryEvent>
[B>E]
*T
~ subProcess => transaction

# cancel-not-interrupting | B | must interrupt
<transaction id="T"><task id="x"/></transaction>
! <boundaryEvent id="B" attachedToRef="T" cancelActivity="false"><cancelEventDefinition/>
</boundaryEvent>[B>E]
*T
~ "false" => "true"

# no-start | P | nothing in it can start
<task id="A"/><task id="B"/>[A>B][B>A]
~ id="B-A" sourceRef="B" targetRef="A" => id="B-A" sourceRef="A" targetRef="B"
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)
