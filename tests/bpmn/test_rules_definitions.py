"""Rules of definitions, ids, artifacts, correlation, services and resources (chapter 8)."""

import pytest
from bpmn_text import HEAD, findings
from rule_cases import PLAIN, Case, assert_breaks_its_rule_alone, names, read_cases

CASES = read_cases("""
# import-type | | which type
^! <import namespace="urn:x"/>
~ <import => <import importType="t"

# import-namespace | | which namespace
^! <import importType="t"/>
~ <import => <import namespace="n"

# extension-not-understood | | 'tns:x'
^! <extension definition="tns:x" mustUnderstand="true"/>
~ true"/> => false"/>

# relationship-type | r | no type
^! <relationship id="r"><source>S</source><target>E</target></relationship>
~ id="r" => id="r" type="t"

# relationship-ends | r | a source or a target
^! <relationship id="r" type="t"><source>S</source></relationship>
~ </source> => </source><target>E</target>

# relationship-direction | r | 'Up'
^! <relationship id="r" type="t" direction="Up"><source>S</source><target>E</target></relationship>
~ Up => Forward

# missing-id | task~1 | a task has no id
<startEvent id="S"/><endEvent id="E"/>[S>E]
! <task/>
~ <task/> => <dataObject/>

# duplicate-id | S | already
*
! <task id="S"/>
~ <task id="S"/> => <dataObject id="D"/>

# duplicate-inner-id | g | 'g', of a group
*
<group id="g"/>
! <group id="g" />
~ "g" /> => "h"/>

# association-end | a | lacks
*
! <association id="a" sourceRef="S"/>
~ sourceRef="S"/> => sourceRef="S" targetRef="E"/>

# association-nowhere | a | 'X'
*
! <association id="a" sourceRef="S" targetRef="X"/>
~ "X" => "E"

# association-direction | a | 'one'
*
! <association id="a" sourceRef="S" targetRef="E" associationDirection="one"/>
~ "one" => "One"

# category-value | g | 'v'
*
! <group id="g" categoryValueRef="v"/>
^ <category id="c"><categoryValue id="w"/></category>
~ id="w" => id="v"

# category-value | S | 'v'
! <startEvent id="S"><categoryValueRef>v</categoryValueRef></startEvent><endEvent id="E"/>[S>E]
^ <category id="c"><categoryValue id="w"/></category>
~ id="w" => id="v"

# correlation-retrieval | c | does not say
^! <correlationProperty id="c"></correlationProperty><message id="m"/>
~ ></corr => ><correlationPropertyRetrievalExpression messageRef="m"><messagePath>x</messagePath>
~~ </correlationPropertyRetrievalExpression></corr

# retrieval-message | c | messageRef names 'n'
^! <correlationProperty id="c"><correlationPropertyRetrievalExpression messageRef="n">
^ <messagePath>x</messagePath></correlationPropertyRetrievalExpression></correlationProperty>
^ <message id="m"/>
~ "n" => "m"

# retrieval-path | c | messagePath
^! <correlationProperty id="c"><correlationPropertyRetrievalExpression messageRef="m">
^ <messagePath/></correlationPropertyRetrievalExpression></correlationProperty>
^ <message id="m"/>
~ <messagePath/> => <messagePath>x</messagePath>

# correlation-key-properties | k | no properties
^ <collaboration id="C">
^! <correlationKey id="k"></correlationKey>
^ </collaboration><correlationProperty id="c"><correlationPropertyRetrievalExpression
^ messageRef="m"><messagePath>x</messagePath></correlationPropertyRetrievalExpression>
^ </correlationProperty><message id="m"/>
~ "k"> => "k"><correlationPropertyRef>c</correlationPropertyRef>

# correlation-key-property | k | 'd'
^ <collaboration id="C">
^! <correlationKey id="k"><correlationPropertyRef>d</correlationPropertyRef></correlationKey>
^ </collaboration><correlationProperty id="c"><correlationPropertyRetrievalExpression
^ messageRef="m"><messagePath>x</messagePath></correlationPropertyRetrievalExpression>
^ </correlationProperty><message id="m"/>
~ >d< => >c<

# subscription-key | P | 'j'
*
! <correlationSubscription correlationKeyRef="j"/>
^ <collaboration id="C"><correlationKey id="k"><correlationPropertyRef>c
^ </correlationPropertyRef></correlationKey></collaboration>
^ <correlationProperty id="c"><correlationPropertyRetrievalExpression
^ messageRef="m"><messagePath>x</messagePath></correlationPropertyRetrievalExpression>
^ </correlationProperty><message id="m"/>
~ "j" => "k"

# binding-property | P | 'd'
*
<correlationSubscription correlationKeyRef="tns:k">
! <correlationPropertyBinding correlationPropertyRef="d"><dataPath>x</dataPath>
</correlationPropertyBinding></correlationSubscription>
^ <collaboration id="C"><correlationKey id="k"><correlationPropertyRef>c</correlationPropertyRef>
^ </correlationKey></collaboration>
^ <correlationProperty id="c"><correlationPropertyRetrievalExpression
^ messageRef="m"><messagePath>x</messagePath></correlationPropertyRetrievalExpression>
^ </correlationProperty><message id="m"/>
~ "d" => "c"

# binding-path | P | dataPath
*
<correlationSubscription correlationKeyRef="k">
! <correlationPropertyBinding correlationPropertyRef="c"><dataPath/>
</correlationPropertyBinding></correlationSubscription>
^ <collaboration id="C"><correlationKey id="k"><correlationPropertyRef>c</correlationPropertyRef>
^ </correlationKey></collaboration>
^ <correlationProperty id="c"><correlationPropertyRetrievalExpression
^ messageRef="m"><messagePath>x</messagePath></correlationPropertyRetrievalExpression>
^ </correlationProperty><message id="m"/>
~ <dataPath/> => <dataPath>x</dataPath>

# error-structure | e | 'i'
^! <error id="e" structureRef="i"/><itemDefinition id="j"/>
~ "i" => "j"

# escalation-structure | e | 'i'
^! <escalation id="e" structureRef="i"/><itemDefinition id="j"/>
~ "i" => "j"

# signal-structure | s | 'i'
^! <signal id="s" structureRef="i"/><itemDefinition id="j"/>
~ "i" => "j"

# message-item | m | 'i'
^! <message id="m" itemRef="i"/><itemDefinition id="j"/>
~ "i" => "j"

# item-kind | i | 'Data'
^! <itemDefinition id="i" itemKind="Data"/>
~ Data => Information

# resource-name | r | no name
^! <resource id="r"/>
~ id="r" => id="r" name="crew"

# resource-parameter-name | r | parameter
^! <resource id="r" name="crew"><resourceParameter id="p"/></resource>
~ id="p" => id="p" name="rank"

# interface-name | i | no name
^! <interface id="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ id="i" => id="i" name="i"

# interface-operations | i | no operation
^! <interface id="i" name="i"></interface><message id="m"/>
~ "i"></ => "i"><operation id="o" name="o"><inMessageRef>m</inMessageRef></operation></

# operation-name | i | operation has no name
^! <interface id="i" name="i"><operation id="o"><inMessageRef>m</inMessageRef></operation>
^ </interface><message id="m"/>
~ id="o" => id="o" name="o"

# operation-in-message | i | 'n'
^! <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>n</inMessageRef></operation>
^ </interface><message id="m"/>
~ >n< => >m<

# operation-out-message | i | 'n'
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef>
^! <outMessageRef>n</outMessageRef></operation></interface><message id="m"/>
~ >n< => >m<

# operation-error | i | 'f'
^ <interface id="i" name="i"><operation id="o" name="o"><inMessageRef>m</inMessageRef>
^! <errorRef>f</errorRef></operation></interface><message id="m"/><error id="e"/>
~ >f< => >e<

# role-resource | T | 'q'
<userTask id="T">
! <performer><resourceRef>q</resourceRef></performer></userTask>
*T
^ <resource id="r" name="r"/>
~ >q< => >r<

# role-named-twice | T | both
<userTask id="T">
! <performer><resourceRef>r</resourceRef><resourceAssignmentExpression><formalExpression>x
</formalExpression></resourceAssignmentExpression></performer></userTask>
*T
^ <resource id="r" name="r"/>
~ <resourceRef>r</resourceRef> => <documentation/>

# role-bindings | T | names no resource
<userTask id="T">
! <potentialOwner>
<resourceParameterBinding parameterRef="p"><formalExpression>x</formalExpression>
</resourceParameterBinding></potentialOwner></userTask>
*T
^ <resource id="r" name="r"><resourceParameter id="p" name="p"/></resource>
~ <potentialOwner> => <potentialOwner><resourceRef>r</resourceRef>

# role-parameter | T | 'q'
<userTask id="T">
<potentialOwner><resourceRef>r</resourceRef>
! <resourceParameterBinding parameterRef="q"><formalExpression>x</formalExpression>
</resourceParameterBinding></potentialOwner></userTask>
*T
^ <resource id="r" name="r"><resourceParameter id="p" name="p"/></resource>
~ "q" => "p"

# role-expression | T | no expression
<userTask id="T"><performer>
! <resourceAssignmentExpression/>
</performer></userTask>
*T
~ Expression/> => Expression><formalExpression>x</formalExpression></resourceAssignmentExpression>
""")


@pytest.mark.parametrize("case", CASES, ids=names(CASES))
def test_a_rule_is_found_where_it_is_broken(case: Case) -> None:
    assert_breaks_its_rule_alone(case)


def test_definitions_without_a_namespace() -> None:
    text = f'{HEAD}<process id="P">{PLAIN}</process></definitions>'
    (found,) = findings(text.replace(' targetNamespace="urn:t"', "").encode())
    assert (found.rule, found.number, found.line) == ("no-target-namespace", "B8201", 1)
    assert findings(text.encode()) == ()


def test_what_an_import_brings_is_not_looked_for() -> None:
    import_ = '<import importType="t" namespace="urn:x" location="x.xsd"/>'
    text = f'{import_}<error id="e" structureRef="x:i"/>'
    data = f'{HEAD}<process id="P">{PLAIN}</process>{text}</definitions>'
    assert "error-structure" not in {
        each.rule
        for each in findings(data.replace("xmlns:tns", 'xmlns:x="urn:x" xmlns:tns').encode())
    }
    wrong = data.replace("xmlns:tns", 'xmlns:x="urn:t" xmlns:tns')
    assert "error-structure" in {each.rule for each in findings(wrong.encode())}
