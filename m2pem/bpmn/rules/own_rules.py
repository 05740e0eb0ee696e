"""m2pem's own rules of mission files: what BPMN leaves open, and what m2pem does not do.

A rule with a fourth cell is an error among warnings: it keeps its number.
"""

from collections.abc import Iterator

from m2pem.bpmn.rules.rule import E, Rule, Topic, W

_MISSIONS = "missions.md"

_FILES = """
unreadable-file | the file cannot be read | name a BPMN 2.0 file
not-xml | the file is not well-formed XML | correct it, or export it again from the editor
not-bpmn | the file's root is not BPMN 2.0's definitions | export it as BPMN 2.0
doctype | the file has a document type declaration | delete it; BPMN files need none
encoding | the text is not in the encoding that the file says | save the file as UTF-8
too-large | the file is larger than the limit (64 MiB) | set M2PEM_MAX_MISSION_MIB
too-deep | elements nest too deep | call processes instead of nesting subprocesses
no-process | the file has no process | draw a process with a start event
empty-process | a process has no elements (a warning for a closed pool) | draw its content
not-executed | m2pem does not execute the element yet | draw it with what missions.md lists
"""
_WORK = """
bad-expression | a text is no expression of the condition language | see conditions.md
bad-script | a script is neither statements nor a behavior | see missions.md
script-language | a script is in a language that m2pem does not run | write statements
behavior-name | a behavior has no name | name a behavior of the catalogue
behavior-type | a behavior's type is none that there is | write vehicle, payload or team
parameter-name | a parameter has no name, or the name of another | give each its own name
role-name | a role has no name, or the name of another | give each its own name
role-allocation | a role is given to nothing, or to several | name one vehicle, payload or team
role-not-literal | a role is an expression | name the vehicle, payload or team itself
requires-reserved | requires= is not yet for missions to use | name the vehicle itself
two-behaviors | a task has several behaviors, or also a service or message | keep one
two-services | a service task names several classes | keep one
service-class | a service has no class | write the class of the service
bad-key | a name is none of the data store | write a dotted name
mapping-source | a mapping of a call activity has no source | write a name or an expression
passes-everything | a call activity passes all its data | list each value
decision-value | a decision has no value, or that of another | give each its own value
wrong-namespace | a prefix or namespace is like m2pem's, but is not | see extensions.md
"""
_DOUBTFUL = """
empty-subprocess | a subprocess has no elements | draw its content, or make it a task
empty-script | a script task has no script | write one, or make it a plain task
no-service | a service task names no service | name one, or make it a plain task
misplaced-extension | an m2pem: name has no effect where it stands | move it, or delete it
unknown-extension | m2pem has no such element or attribute | correct it, or delete it | error
association-ignored | a data association of a call activity passes nothing | use m2pem:in, m2pem:out
unwritten-name | a name is read that nothing writes | write it before, or pass it in
outside-only | what is awaited only the outside can send | mark it m2pem:from="operator"
no-conditions | no flow out of a gateway has a condition | give the flows conditions
call-recursion | a process can call itself | make sure that a decision can end it
empty-assignment | an assignment's 'from' is empty | write what it assigns, or delete it
foreign-extension | another program's extension elements have no effect here | see extensions.md
endless-loop | a loop has no wait and no end | wait in each round, or draw a way out | error
busy-loop | a loop has no wait; only data can end it | wait in each round, or count the rounds
"""


def _rules() -> Iterator[Rule]:
    for first, severity, table in ((101, E, _FILES), (201, E, _WORK), (301, W, _DOUBTFUL)):
        for number, line in enumerate(table.strip().splitlines(), first):
            slug, wrong, right, *level = line.split(" | ")
            yield Rule(number, slug, _MISSIONS, E if level else severity, wrong, right)


TOPIC = Topic(tuple(_rules()), {})
