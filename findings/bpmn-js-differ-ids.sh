#!/usr/bin/env bash
# Program: bpmn-js-differ 3.2.0 with bpmn-moddle 10.3.1. Date: 2026-11-29.
# Expected: the "semantic" diff of two versions of a diagram names the event whose timer or message has changed.
# Seen: if the event definition has an id, as bpmn-js and Camunda Modeler write it, a change inside it is not found:
#   PT5S against PT50S, or another message, is no difference. Without the id, which is optional, the same change is found.
#   A task that is moved to another lane is not found either.
# Matters: a review that trusts the diff passes a mission whose waiting time has grown tenfold.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund bpmn-js-differ@3.2.0 bpmn-moddle@10.3.1 >/dev/null

cat > try.mjs <<'EOF'
import { diff } from 'bpmn-js-differ';
import { BpmnModdle } from 'bpmn-moddle';
const read = async (body) => (await new BpmnModdle().fromXML(`<definitions id="d" targetNamespace="urn:t"
  xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"><message id="M"/><message id="N"/>
  <process id="P">${body}</process></definitions>`)).rootElement;
const timer = (id) => (value) => `<intermediateCatchEvent id="T"><timerEventDefinition ${id}>
  <timeDuration>${value}</timeDuration></timerEventDefinition></intermediateCatchEvent>`;
const message = (value) => `<intermediateCatchEvent id="T">
  <messageEventDefinition id="D" messageRef="${value}"/></intermediateCatchEvent>`;
const lane = (value) => `<laneSet id="L">${['l1', 'l2'].map((l) => `<lane id="${l}">
  ${l === value ? '<flowNodeRef>T</flowNodeRef>' : ''}</lane>`).join('')}</laneSet><task id="T"/>`;
for (const [name, make, before, after] of [
  ['timer', timer(''), 'PT5S', 'PT50S'], ['timer with id', timer('id="D"'), 'PT5S', 'PT50S'],
  ['message with id', message, 'M', 'N'], ['lane', lane, 'l1', 'l2'],
]) {
  const found = diff(await read(make(before)), await read(make(after)));
  console.log(name, ['_added', '_removed', '_changed', '_layoutChanged'].flatMap((kind) => Object.keys(found[kind])));
}
EOF
diff <(node try.mjs) - <<'EOF'
timer [ 'T' ]
timer with id []
message with id []
lane []
EOF
echo "as seen: changes in an event definition that has an id, and of the lane, are no difference"
