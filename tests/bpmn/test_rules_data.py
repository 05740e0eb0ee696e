"""Rules of data: objects, stores, inputs and outputs, associations (10.4)."""

import pytest
from rule_cases import Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# data-reference-object | R | names no data object
! <dataObjectReference id="R"/><dataObject id="D"/>
*
~ id="R" => id="R" dataObjectRef="D"

# data-reference-item | R | of its own
! <dataObjectReference id="R" dataObjectRef="D" itemSubjectRef="i"/><dataObject id="D"/>
*
^ <itemDefinition id="i"/>
~ itemSubjectRef="i"/><dataObject id="D"/> => /><dataObject id="D" itemSubjectRef="i"/>

# data-object-state | D | state
! <dataObject id="D"><dataState name="sent"/></dataObject>
<dataObjectReference id="R" dataObjectRef="D"/>
*
~ <dataState name="sent"/></dataObject> => </dataObject>

# data-item | D | 'j'
! <dataObject id="D" itemSubjectRef="j"/>
*
^ <itemDefinition id="i"/>
~ "j" => "i"

# collection-mismatch | D | 'i'
! <dataObject id="D" itemSubjectRef="i" isCollection="true"/>
*
^ <itemDefinition id="i"/>
~ id="i"/> => id="i" isCollection="true"/>

# store-capacity | s | 'much'
^! <dataStore id="s" name="s" capacity="much"/>
~ much => 12

# no-input-set | T | no input set
<task id="T">
! <ioSpecification><outputSet/></ioSpecification>
</task>
*T
~ <outputSet/> => <inputSet/><outputSet/>

# no-output-set | T | no output set
<task id="T">
! <ioSpecification><inputSet/></ioSpecification>
</task>
*T
~ <inputSet/> => <inputSet/><outputSet/>

# input-in-no-set | T | 'i'
<task id="T"><ioSpecification>
! <dataInput id="i"/>
<inputSet></inputSet><outputSet/></ioSpecification></task>
*T
~ <inputSet> => <inputSet><dataInputRefs>tns:i</dataInputRefs>

# output-in-no-set | T | 'way'
<task id="T"><ioSpecification>
! <dataOutput id="o" name="way"/>
<inputSet/><outputSet></outputSet></ioSpecification></task>
*T
~ <outputSet> => <outputSet><dataOutputRefs>tns:o</dataOutputRefs>

# input-set-reference | T | 'j'
<task id="T"><ioSpecification>
<dataInput id="i"/>
! <inputSet><dataInputRefs>i</dataInputRefs><dataInputRefs>j</dataInputRefs></inputSet><outputSet/>
</ioSpecification></task>
*T
~ <dataInputRefs>j</dataInputRefs> => <documentation/>

# output-set-reference | T | 'p'
<task id="T"><ioSpecification>
<dataOutput id="o"/><inputSet/>
! <outputSet><dataOutputRefs>o</dataOutputRefs><dataOutputRefs>p</dataOutputRefs></outputSet>
</ioSpecification></task>
*T
~ <dataOutputRefs>p</dataOutputRefs> => <documentation/>

# optional-input | T | 'j'
<task id="T"><ioSpecification>
<dataInput id="i"/>
! <inputSet><dataInputRefs>i</dataInputRefs><optionalInputRefs>j</optionalInputRefs></inputSet>
<outputSet/></ioSpecification></task>
*T
~ >j< => >i<

# optional-output | T | 'p'
<task id="T"><ioSpecification>
<dataOutput id="o"/><inputSet/>
! <outputSet><dataOutputRefs>o</dataOutputRefs><whileExecutingOutputRefs>p
</whileExecutingOutputRefs></outputSet>
</ioSpecification></task>
*T
~ Refs>p => Refs>o

# paired-set | T | 'no'
<task id="T"><ioSpecification>
! <inputSet id="in"><outputSetRefs>no</outputSetRefs></inputSet>
<outputSet id="out"/>
</ioSpecification></task>
*T
~ >no< => >out<

# subprocess-data | T | of its own
<subProcess id="T">
! <ioSpecification><inputSet/><outputSet/></ioSpecification>
<task id="x"/></subProcess>
*T
~ <ioSpecification><inputSet/><outputSet/></ioSpecification> => <documentation/>

# data-association-target | T | targetRef
<dataObject id="D"/>
<task id="T">
! <dataInputAssociation><sourceRef>D</sourceRef></dataInputAssociation>
</task>
*T
~ </sourceRef> => </sourceRef><targetRef>D</targetRef>

# data-association-end | T | 'X'
<dataObject id="D"/>
<task id="T">
! <dataInputAssociation><sourceRef>X</sourceRef><targetRef>D</targetRef></dataInputAssociation>
</task>
*T
~ >X< => >D<

# data-association-sources | T | this one has 2
<dataObject id="D"/><dataObject id="F"/>
<task id="T">
! <dataInputAssociation><sourceRef>D</sourceRef><sourceRef>F</sourceRef><targetRef>D</targetRef>
</dataInputAssociation></task>
*T
~ <sourceRef>F</sourceRef><targetRef>D</targetRef> => <sourceRef>F</sourceRef><targetRef>D
~~ </targetRef><transformation>D + F</transformation>

# data-association-items | T | 'D' is 'string' and 'x' is 'int'
^ <itemDefinition id="I" structureRef="string"/><itemDefinition id="J" structureRef="int"/>
^ <itemDefinition id="K" structureRef="string"/>
<dataObject id="F" itemSubjectRef="I"/><dataObjectReference id="D" dataObjectRef="F"/>
<task id="T"><ioSpecification><dataInput id="x" itemSubjectRef="J"/>
<inputSet><dataInputRefs>x</dataInputRefs></inputSet><outputSet/></ioSpecification>
! <dataInputAssociation><sourceRef>D</sourceRef><targetRef>x</targetRef>
</dataInputAssociation></task>
*T
~ itemSubjectRef="J" => itemSubjectRef="K"

# bad-assignment | T | what to write
<task id="T"><ioSpecification><dataInput id="i"/><inputSet><dataInputRefs>i</dataInputRefs>
</inputSet><outputSet/></ioSpecification><dataInputAssociation><targetRef>i</targetRef>
! <assignment><to>i</to></assignment>
</dataInputAssociation></task>
*T
~ <assignment> => <assignment><from>2</from>

# process-input-written | T | 'i'
<ioSpecification><dataInput id="i"/><inputSet><dataInputRefs>i</dataInputRefs></inputSet>
<outputSet/></ioSpecification><dataObject id="D"/><dataObject id="F"/>
<task id="T">
! <dataOutputAssociation><sourceRef>D</sourceRef><targetRef>i</targetRef></dataOutputAssociation>
</task>
*T
~ <targetRef>i => <targetRef>F

# process-output-read | T | 'o'
<ioSpecification><dataOutput id="o"/><inputSet/><outputSet><dataOutputRefs>o</dataOutputRefs>
</outputSet></ioSpecification><dataObject id="D"/><dataObject id="F"/>
<task id="T">
! <dataInputAssociation><sourceRef>o</sourceRef><targetRef>F</targetRef></dataInputAssociation>
</task>
*T
~ <sourceRef>o => <sourceRef>D
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)
