"""Rules of pools, message flows, conversations, lanes and processes (7.6.3, 9, 10.1, 10.8)."""

import pytest
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# pool-minimum | p | '-1'
^ <collaboration id="C"><participant id="p">
^! <participantMultiplicity minimum="-1" maximum="3"/>
^ </participant></collaboration>
~ -1 => 1

# pool-maximum | p | '2'
^ <collaboration id="C"><participant id="p">
^! <participantMultiplicity minimum="3" maximum="2"/>
^ </participant></collaboration>
~ "2" => "3"

# participant-interface | p | 'j'
^ <collaboration id="C"><participant id="p">
^! <interfaceRef>j</interfaceRef>
^ </participant></collaboration><interface id="i" name="i">
^ <operation id="o" name="o"><inMessageRef>m</inMessageRef></operation></interface>
^ <message id="m"/>
~ >j< => >i<

# participant-end-point | p | 'f'
^ <collaboration id="C"><participant id="p">
^! <endPointRef>f</endPointRef>
^ </participant></collaboration><endPoint id="e"/>
~ >f< => >e<

# partner-participant | r | partnerRole names 'q'
^ <collaboration id="C"><participant id="p"/></collaboration>
^! <partnerRole id="r" name="r"><participantRef>q</participantRef></partnerRole>
~ >q< => >p<

# participant-association | a | outerParticipantRef is 'q'
^ <collaboration id="C"><participant id="p"/>
^! <participantAssociation id="a"><innerParticipantRef>p</innerParticipantRef>
^ <outerParticipantRef>q</outerParticipantRef></participantAssociation></collaboration>
~ >q< => >p<

# message-flow-from-catch | m | 'S' is one
<startEvent id="S"><messageEventDefinition messageRef="n"/></startEvent><endEvent id="E"/>[S>E]
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="S" targetRef="p"/>
^ </collaboration><message id="n"/>
~ sourceRef="S" targetRef="p" => sourceRef="p" targetRef="S"

# message-flow-into-throw | m | 'E' is one
<startEvent id="S"/><endEvent id="E"><messageEventDefinition messageRef="n"/></endEvent>[S>E]
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="p" targetRef="E"/>
^ </collaboration><message id="n"/>
~ sourceRef="p" targetRef="E" => sourceRef="E" targetRef="p"

# message-flow-into-other | m | 'S'
<startEvent id="S"/><endEvent id="E"/>[S>T][T>E]<task id="T"/>
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="p" targetRef="S"/>
^ </collaboration>
~ sourceRef="p" targetRef="S" => sourceRef="p" targetRef="T"

# message-flow-from-other | m | 'E'
<startEvent id="S"/><endEvent id="E"/>[S>T][T>E]<task id="T"/>
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="E" targetRef="p"/>
^ </collaboration>
~ sourceRef="E" => sourceRef="T"

# message-flow-message | m | 'N' is not 'M' of 'T'
<startEvent id="S"/><endEvent id="E"/>[S>T][T>E]<sendTask id="T" messageRef="M"/>
^ <message id="M" name="M"/><message id="N" name="N"/>
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="T" targetRef="p" messageRef="N"/>
^ </collaboration>
~ messageRef="N" => messageRef="M"

# message-flow-end | m | 'G' is an exclusive gateway
<startEvent id="S"/><endEvent id="E"/>[S>G][T>E]<task id="T"/>
<exclusiveGateway id="G"/>[G>T]<sequenceFlow id="f" sourceRef="S" targetRef="G"/>
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="p" targetRef="G"/>
^ </collaboration>
~ sourceRef="p" targetRef="G" => sourceRef="p" targetRef="T"

# message-flow-inside | m | both ends are in 'P'
<startEvent id="S"/><endEvent id="E"/>[S>T][T>E]<task id="T"/><task id="U"/>[S>U]
^ <collaboration id="C"><participant id="p"/>
^! <messageFlow id="m" sourceRef="U" targetRef="T"/>
^ </collaboration>
~ sourceRef="U" targetRef="T" => sourceRef="p" targetRef="T"

# message-flow-association | a | innerMessageFlowRef is 'n'
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^ <messageFlow id="m" sourceRef="p" targetRef="q"/>
^! <messageFlowAssociation id="a" innerMessageFlowRef="n" outerMessageFlowRef="m"/>
^ </collaboration>
~ "n" => "m"

# conversation-participants | n | this one has 1
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^! <conversation id="n"><participantRef>p</participantRef></conversation>
^ </collaboration>
~ </participantRef> => </participantRef><participantRef>q</participantRef>

# conversation-participant | n | 'r'
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^! <conversation id="n"><participantRef>p</participantRef><participantRef>r</participantRef>
^ </conversation></collaboration>
~ >r< => >q<

# conversation-message-flow | n | 'k'
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^ <messageFlow id="m" sourceRef="p" targetRef="q"/>
^ <conversation id="n"><participantRef>p</participantRef><participantRef>q</participantRef>
^! <messageFlowRef>k</messageFlowRef>
^ </conversation></collaboration>
~ >k< => >m<

# conversation-link-ends | l | a conversation and a pool
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^ <conversation id="n"><participantRef>p</participantRef><participantRef>q</participantRef>
^ </conversation>
^! <conversationLink id="l" sourceRef="p" targetRef="q"/>
^ </collaboration>
~ targetRef="q" => targetRef="n"

# conversation-association | a | outerConversationNodeRef is 'o'
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^ <conversation id="n"><participantRef>p</participantRef><participantRef>q</participantRef>
^ </conversation>
^! <conversationAssociation id="a" innerConversationNodeRef="n" outerConversationNodeRef="o"/>
^ </collaboration>
~ "o" => "n"

# called-collaboration | n | 'D'
^ <collaboration id="C"><participant id="p"/><participant id="q"/>
^! <callConversation id="n" calledCollaborationRef="D"><participantRef>p</participantRef>
^ <participantRef>q</participantRef></callConversation></collaboration>
~ "D" => "C"

# collaboration-choreography | C | 'D'
^ <collaboration id="C"><participant id="p"/>
^! <choreographyRef>D</choreographyRef>
^ </collaboration><choreography id="H"/>
~ >D< => >H<

# process-type | Q | 'private'
^! <process id="Q" processType="private"><startEvent id="x"/><endEvent id="y"/>[x>y]</process>
~ private => Private

# public-executable | Q | must not be executable
^! <process id="Q" processType="Public" isExecutable="true"><startEvent id="x"/><endEvent id="y"/>
^ [x>y]</process>
~ Public => Private

# definitional-collaboration | Q | 'D'
^! <process id="Q" definitionalCollaborationRef="D"><startEvent id="x"/><endEvent id="y"/>
^ [x>y]</process><collaboration id="C"/>
~ "D" => "C"

# supported-process | Q | 'R'
^ <process id="Q"><startEvent id="x"/><endEvent id="y"/>[x>y]
^! <supports>R</supports>
^ </process>
~ >R< => >P<

# lane-node-twice | b | 'S' is in 'a', too
<laneSet id="L"><lane id="a"><flowNodeRef>S</flowNodeRef></lane><lane id="b">
! <flowNodeRef>S</flowNodeRef>
</lane></laneSet>
*
~ <lane id="a"><flowNodeRef>S</flowNodeRef> => <lane id="a"><flowNodeRef>tns:E</flowNodeRef>

# lane-other-process | a | 'x'
<laneSet id="L"><lane id="a">
! <flowNodeRef>x</flowNodeRef>
</lane></laneSet>
*
^ <process id="Q"><startEvent id="x"/><endEvent id="y"/>[x>y]</process>
~ >x< => >S<

# lane-no-node | a | 'D' is a data object
<laneSet id="L"><lane id="a">
! <flowNodeRef>D</flowNodeRef>
</lane></laneSet>
<dataObject id="D"/>
*
~ >D< => >S<

# lane-partition | a | 'q'
<laneSet id="L">
! <lane id="a" partitionElementRef="q"/>
</laneSet>
*
^ <resource id="r" name="r"/>
~ "q" => "r"
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)
