#!/usr/bin/env bash
# Programs: bpmn-moddle 10.3.1 (the reader of bpmn-js and of many tools), SpiffWorkflow 3.2.0. Date: 2026-11-29.
# Expected: BPMN 2.0's attributes such as isExecutable, cancelActivity and isInterrupting are xsd:boolean, whose lexical
#   forms are "true", "false", "1" and "0" (XML Schema Part 2, 3.2.2.1). cancelActivity="1" interrupts, as the default does.
# Seen: both compare the text with "true". "1" is read as false: an executable process is not (SpiffWorkflow refuses
#   it), and an interrupting boundary event no longer interrupts: the task stays open beside its handler.
# Matters: a valid file of a tool that writes "1" means the opposite, without a warning.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund bpmn-moddle@10.3.1 >/dev/null
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile SpiffWorkflow==3.2.0

for value in 1 true; do cat > "$value.bpmn" <<EOF
<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t">
  <process id="P" isExecutable="$value">
    <startEvent id="S"/>
    <sequenceFlow id="f1" sourceRef="S" targetRef="A"/>
    <manualTask id="A"/>
    <sequenceFlow id="f2" sourceRef="A" targetRef="E"/>
    <boundaryEvent id="B" attachedToRef="A" cancelActivity="$value">
      <timerEventDefinition><timeDuration>"PT0S"</timeDuration></timerEventDefinition>
    </boundaryEvent>
    <sequenceFlow id="f3" sourceRef="B" targetRef="R"/>
    <manualTask id="R"/>
    <sequenceFlow id="f4" sourceRef="R" targetRef="E"/>
    <endEvent id="E"/>
  </process>
</definitions>
EOF
done
cat > try.mjs <<'EOF'
import { BpmnModdle } from 'bpmn-moddle';
import { readFileSync } from 'node:fs';
for (const value of ['1', 'true']) {
  const { rootElement, warnings } = await new BpmnModdle().fromXML(readFileSync(`${value}.bpmn`, 'utf8'));
  const [process] = rootElement.rootElements;
  const event = process.flowElements.find((e) => e.id === 'B');
  console.log(value, process.isExecutable, event.cancelActivity, 'warnings', warnings.length);
}
EOF
cat > try.py <<'EOF'
from lxml import etree
from SpiffWorkflow.bpmn import BpmnWorkflow
from SpiffWorkflow.bpmn.parser import BpmnParser
from SpiffWorkflow.util.task import TaskState
for value in ("1", "true"):
    root = etree.parse(f"{value}.bpmn").getroot()
    try:
        parser = BpmnParser()
        parser.add_bpmn_xml(root)
        parser.get_spec("P")
    except Exception as error:
        print(value, str(error).rstrip(". "))
    root[0].set("isExecutable", "true")
    parser = BpmnParser()
    parser.add_bpmn_xml(root)
    run = BpmnWorkflow(parser.get_spec("P"))
    run.do_engine_steps()
    run.refresh_waiting_tasks()
    run.do_engine_steps()
    print(value, "to do:", sorted(t.task_spec.bpmn_id for t in run.get_tasks(state=TaskState.READY)))
EOF
diff <(node try.mjs && venv/bin/python try.py) - <<'EOF'
1 false false warnings 0
true true true warnings 0
1 Process P is not executable
1 to do: ['A', 'R']
true to do: ['R']
EOF
echo 'as seen: "1" is read as false by both'
