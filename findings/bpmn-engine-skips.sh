#!/usr/bin/env bash
# Program: bpmn-engine 25.0.1 (bpmn-elements). Date: 2026-11-29.
# Expected: a conditional flow whose condition is "false" is not taken, and one in an expression language that the engine
#   does not have ("x > 10") is an error. A task with standardLoopCharacteristics loopMaximum 3 runs up to three times
#   (BPMN 2.0.2, 13.3.6), or the engine says that it does not support it, as it does for complexGateway.
# Seen: only ${...} is evaluated; any other text is a string that is not empty, hence true: both flows "false" and
#   "x > 10" (x is 5) are taken instead of the default. The task with the standard loop runs once. Neither gives an error.
# Matters: a diagram written for another engine passes every gate that should have stopped it.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund bpmn-engine@25.0.1 >/dev/null

cat > try.mjs <<'EOF'
import { Engine } from 'bpmn-engine';
import { EventEmitter } from 'node:events';
const file = (body) => `<definitions id="d" xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><process id="P" isExecutable="true">${body}</process></definitions>`;
const choice = (condition) => `<startEvent id="S"/><exclusiveGateway id="X" default="no"/><task id="GO"/><task id="STOP"/>
  <sequenceFlow id="f1" sourceRef="S" targetRef="X"/><sequenceFlow id="no" sourceRef="X" targetRef="STOP"/>
  <sequenceFlow id="yes" sourceRef="X" targetRef="GO">
    <conditionExpression xsi:type="tFormalExpression">${condition}</conditionExpression></sequenceFlow>`;
const loop = `<startEvent id="S"/><sequenceFlow id="f1" sourceRef="S" targetRef="T"/>
  <task id="T"><standardLoopCharacteristics loopMaximum="3"/></task>`;
for (const [name, body] of [
  ['${false}', choice('${false}')], ['false', choice('false')], ['x > 10', choice('x &gt; 10')], ['loop', loop],
]) {
  const ended = [], listener = new EventEmitter();
  listener.on('activity.end', ({ id }) => ended.push(id));
  await new Promise((resolve, reject) => new Engine({ source: file(body) })
    .execute({ listener, variables: { x: 5 } }, (error) => (error ? reject(error) : resolve())));
  console.log(name, ended.join(' '));
}
EOF
diff <(node try.mjs) - <<'EOF'
${false} S X STOP
false S X GO
x > 10 S X GO
loop S T
EOF
echo 'as seen: a condition without ${} is always true, and a standard loop runs once'
