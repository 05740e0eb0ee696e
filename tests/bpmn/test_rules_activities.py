"""Rules of tasks, calls, subprocesses and loops (10.3)."""

import pytest
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# start-quantity | T | startQuantity
! <task id="T" startQuantity="none"/>
*T
~ none => 2

# start-quantity | T | no number of tokens
! <task id="T" startQuantity="0"/>
*T
~ "0" => "1"

# completion-quantity | T | completionQuantity
! <task id="T" completionQuantity="-1"/>
*T
~ -1 => 2

# task-operation | T | 'p'
! <serviceTask id="T" operationRef="p"/>
*T
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ "p" => "o"

# service-data | T | several input sets
! <serviceTask id="T"><ioSpecification><inputSet/><inputSet/><outputSet/></ioSpecification>
</serviceTask>
*T
~ <inputSet/><inputSet/> => <inputSet/>

# send-data | T | several data inputs
! <sendTask id="T" messageRef="m"><ioSpecification>
<dataInput id="a"/><dataInput id="b"/>
<inputSet><dataInputRefs>a</dataInputRefs><dataInputRefs>b</dataInputRefs></inputSet><outputSet/>
</ioSpecification></sendTask>
*T
^ <message id="m"/>
~ <dataInput id="b"/> => <documentation/>
~ <dataInputRefs>b</dataInputRefs> => <documentation/>

# receive-data | T | several data outputs
! <receiveTask id="T" messageRef="m"><ioSpecification>
<dataOutput id="a"/><inputSet/>
<outputSet><dataOutputRefs>a</dataOutputRefs></outputSet><outputSet/>
</ioSpecification></receiveTask>
*T
^ <message id="m"/>
~ </outputSet><outputSet/> => </outputSet>

# receive-begins | T | incoming flow
! <receiveTask id="T" messageRef="m" instantiate="true"/>
*T
^ <message id="m"/>
~ "true" => "false"

# no-called-element | T | what it calls
! <callActivity id="T"/>
*T
^ <process id="Q"><task id="x"/></process>
~ id="T" => id="T" calledElement="Q"

# supported-interface | P | 'j'
! <supportedInterfaceRef>j</supportedInterfaceRef>
*
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ >j< => >i<

# io-binding | P | inputDataRef is 'x'
<ioSpecification><inputSet id="in"/><outputSet id="out"/></ioSpecification>
! <ioBinding operationRef="o" inputDataRef="x" outputDataRef="out"/>
*
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ "x" => "in"

# typed-start-in-subprocess | x | embedded
<subProcess id="T">
! <startEvent id="x"><signalEventDefinition signalRef="s"/></startEvent>
<endEvent id="y"/>[x>y]</subProcess>
*T
^ <signal id="s"/>
~ <signalEventDefinition signalRef="s"/> => <documentation/>

# event-subprocess-incoming | X | incoming
*
! <subProcess id="X" triggeredByEvent="true">
<startEvent id="x"><errorEventDefinition/></startEvent><endEvent id="y"/>[x>y]</subProcess>
[S>X]
~ id="S-X" sourceRef="S" targetRef="X" => id="S-X" sourceRef="S" targetRef="E"

# event-subprocess-outgoing | X | outgoing
*
! <subProcess id="X" triggeredByEvent="true">
<startEvent id="x"><errorEventDefinition/></startEvent><endEvent id="y"/>[x>y]</subProcess>
[X>E]
~ id="X-E" sourceRef="X" => id="X-E" sourceRef="S"

# event-subprocess-starts | X | this one has 2
*
! <subProcess id="X" triggeredByEvent="true">
<startEvent id="x"><errorEventDefinition/></startEvent><endEvent id="y"/>[x>y]
<startEvent id="z"><escalationEventDefinition/></startEvent>[z>y]
</subProcess>
~ <startEvent id="z"><escalationEventDefinition/></startEvent> => <task id="z"/>

# event-subprocess-twice | Y | 'X' does, too
*
<subProcess id="X" triggeredByEvent="true">
<startEvent id="x"><errorEventDefinition errorRef="e"/></startEvent><endEvent id="y"/>[x>y]
</subProcess>
! <subProcess id="Y" triggeredByEvent="true">
<startEvent id="v"><errorEventDefinition errorRef="tns:e" /></startEvent><endEvent id="w"/>[v>w]
</subProcess>
^ <error id="e" errorCode="1"/><error id="f" errorCode="2"/>
~ "tns:e" => "f"

# transaction-method | T | '##Undo'
! <transaction id="T" method="##Undo"><task id="x"/></transaction>
*T
~ ##Undo => ##Store

# ad-hoc-activities | T | no activity
! <adHocSubProcess id="T"><inclusiveGateway id="x"/></adHocSubProcess>
*T
~ inclusiveGateway => task

# ad-hoc-start | x | start event
<adHocSubProcess id="T"><task id="A"/>
! <startEvent id="x"/>
[x>A]</adHocSubProcess>
*T
~ startEvent id="x" => task id="x"

# ad-hoc-end | x | end event
<adHocSubProcess id="T"><task id="A"/>
! <endEvent id="x"/>
[A>x]</adHocSubProcess>
*T
~ endEvent id="x" => task id="x"

# ad-hoc-cancel | T | Sequential
! <adHocSubProcess id="T" ordering="Sequential" cancelRemainingInstances="true"><task id="A"/>
</adHocSubProcess>
*T
~ Sequential => Parallel

# ad-hoc-ordering | T | 'serial'
! <adHocSubProcess id="T" ordering="serial"><task id="A"/></adHocSubProcess>
*T
~ "serial" => "Sequential"

# two-loops | T | one loop marker
<task id="T"><standardLoopCharacteristics loopMaximum="2"/>
! <multiInstanceLoopCharacteristics><loopCardinality>2</loopCardinality>
</multiInstanceLoopCharacteristics></task>
*T
~ <standardLoopCharacteristics loopMaximum="2"/> => <documentation/>

# loop-maximum | T | 'many'
<task id="T">
! <standardLoopCharacteristics loopMaximum="many"/>
</task>
*T
~ many => 3

# loop-without-condition | T | how long
<task id="T">
! <standardLoopCharacteristics></standardLoopCharacteristics>
</task>
*T
~ ></standard => ><loopCondition>a</loopCondition></standard

# instance-count | T | how many
<task id="T">
! <multiInstanceLoopCharacteristics></multiInstanceLoopCharacteristics>
</task>
*T
~ ></multi => ><loopCardinality>3</loopCardinality></multi

# instance-count | T | how many
<task id="T">
! <multiInstanceLoopCharacteristics/>
</task>
*T
~ Characteristics/> => Characteristics camunda:collection="all"/>

# instances-counted-twice | T | both
<dataObject id="D"/><task id="T">
! <multiInstanceLoopCharacteristics><loopCardinality>3</loopCardinality>
<loopDataInputRef>D</loopDataInputRef></multiInstanceLoopCharacteristics></task>
*T
~ <loopCardinality>3</loopCardinality> => <documentation/>

# instances-behavior | T | 'one'
<task id="T">
! <multiInstanceLoopCharacteristics behavior="one"><loopCardinality>3</loopCardinality>
</multiInstanceLoopCharacteristics></task>
*T
~ "one" => "One"

# instances-event-unused | T | oneBehaviorEventRef with the behavior None
<task id="T">
! <multiInstanceLoopCharacteristics behavior="None" oneBehaviorEventRef="d">
<loopCardinality>3</loopCardinality></multiInstanceLoopCharacteristics></task>
*T
^ <signalEventDefinition id="d" signalRef="s"/><signal id="s"/>
~ oneB => noneB

# instances-complex | T | what is thrown
<task id="T">
! <multiInstanceLoopCharacteristics behavior="Complex">
<loopCardinality>3</loopCardinality></multiInstanceLoopCharacteristics></task>
*T
~ "Complex" => "All"

# instances-complex-unused | T | without the behavior Complex
<task id="T">
! <multiInstanceLoopCharacteristics behavior="All"><loopCardinality>3</loopCardinality>
<complexBehaviorDefinition><condition>a</condition></complexBehaviorDefinition>
</multiInstanceLoopCharacteristics></task>
*T
~ "All" => "Complex"

# input-item-without-input | T | inputDataItem
<task id="T">
! <multiInstanceLoopCharacteristics><loopCardinality>3</loopCardinality>
<inputDataItem id="i"/></multiInstanceLoopCharacteristics></task>
*T
~ <inputDataItem id="i"/> => <documentation/>

# output-without-item | T | is missing
<dataObject id="D"/><task id="T">
! <multiInstanceLoopCharacteristics><loopCardinality>3</loopCardinality>
<loopDataOutputRef>D</loopDataOutputRef></multiInstanceLoopCharacteristics></task>
*T
~ </loopDataOutputRef> => </loopDataOutputRef><outputDataItem id="o"/>


# complex-behavior | T | and what
<task id="T">
<multiInstanceLoopCharacteristics behavior="Complex"><loopCardinality>3</loopCardinality>
! <complexBehaviorDefinition><condition>a</condition></complexBehaviorDefinition>
</multiInstanceLoopCharacteristics></task>
*T
^ <signal id="s"/>
~ </condition> => </condition>
~~ <event id="x" xsi:type="tImplicitThrowEvent"><signalEventDefinition signalRef="s"/></event>

# loop-not-allowed | X | loop marker
*
<subProcess id="X" triggeredByEvent="true">
! <standardLoopCharacteristics loopMaximum="2"/>
<startEvent id="x"><errorEventDefinition/></startEvent><endEvent id="y"/>[x>y]</subProcess>
~ <standardLoopCharacteristics loopMaximum="2"/> => <documentation/>

# no-loop | T | which kind
<task id="T">
! <loopCharacteristics/>
</task>
*T
~ <loopCharacteristics/> => <standardLoopCharacteristics loopMaximum="2"/>

# event-not-allowed | T | by itself
<task id="T">
<multiInstanceLoopCharacteristics behavior="One" oneBehaviorEventRef="d">
<loopCardinality>3</loopCardinality></multiInstanceLoopCharacteristics></task>
*T
^ <signal id="s"/><signalEventDefinition id="e" signalRef="s"/>
^! <terminateEventDefinition id="d"/>
~ oneBehaviorEventRef="d" => oneBehaviorEventRef="e"
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)
