#!/usr/bin/env bash
# Program: SpiffWorkflow 3.2.0. Date: 2026-11-29.
# Expected: a conditional sequence flow out of a task is taken only if its condition is true (BPMN 2.0.2,
#   13.3.1 Sequence Flow Considerations); an engine that does not support conditions there refuses the file.
# Seen: with two outgoing flows the parser does refuse. With one, it accepts the file and never evaluates the condition:
#   the flow is taken although it is False, even if the expression names a variable that does not exist. Behind an
#   exclusive gateway the same lone condition counts.
# Matters: "continue only if the area is clear", drawn without a diamond, always continues.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile SpiffWorkflow==3.2.0

cat > try.py <<'EOF'
from lxml import etree
from SpiffWorkflow.bpmn import BpmnWorkflow
from SpiffWorkflow.bpmn.parser import BpmnParser
from SpiffWorkflow.util.task import TaskState

FILE = """<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><process id="P" isExecutable="true">
  <startEvent id="S"/><sequenceFlow id="f1" sourceRef="S" targetRef="A"/><{kind} id="A"/><task id="B"/>{more}
  <sequenceFlow id="f2" sourceRef="A" targetRef="B">
    <conditionExpression xsi:type="tFormalExpression">{condition}</conditionExpression></sequenceFlow></process></definitions>"""
TWO = """<sequenceFlow id="f3" sourceRef="A" targetRef="C">
    <conditionExpression xsi:type="tFormalExpression">True</conditionExpression></sequenceFlow><task id="C"/>"""
for kind, condition, more in [("task", "False", ""), ("task", "no_such_name", ""), ("task", "False", TWO),
                              ("exclusiveGateway", "False", "")]:
    try:
        parser = BpmnParser()
        parser.add_bpmn_xml(etree.fromstring(FILE.format(kind=kind, condition=condition, more=more)))
        run = BpmnWorkflow(parser.get_spec("P"))
        for _ in range(5):
            run.do_engine_steps()
            for task in run.get_tasks(state=TaskState.READY):
                task.run()
        done = [t.task_spec.bpmn_id for t in run.get_tasks(state=TaskState.COMPLETED) if t.task_spec.bpmn_id]
        print(kind, condition, "completed", done)
    except Exception as error:
        print(kind, condition, type(error).__name__)
EOF
diff <(venv/bin/python try.py) - <<'EOF'
task False completed ['S', 'A', 'B']
task no_such_name completed ['S', 'A', 'B']
task False ValidationException
exclusiveGateway False WorkflowException
EOF
echo "as seen: the only flow out of a task is taken whatever its condition"
