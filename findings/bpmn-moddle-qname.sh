#!/usr/bin/env bash
# Program: bpmn-moddle 10.3.1 (the reader of bpmn-js, Camunda Modeler, bpmnlint). Date: 2026-11-29.
# Expected: messageRef, signalRef and errorRef are of type xsd:QName and may carry the prefix of the file's
#   own targetNamespace (Semantic.xsd): tns:M is the message with id M.
# Seen: the reference is compared with the ids as text, prefix included. The message stays undefined; the only trace is
#   an entry in "warnings" of a promise that is fulfilled. Written out again, the reference is gone from the file.
# Matters: opening and saving a valid file of another tool takes the messages off its events.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund bpmn-moddle@10.3.1 >/dev/null

cat > try.mjs <<'EOF'
import { BpmnModdle } from 'bpmn-moddle';
const file = (ref) => `<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL"
  xmlns:tns="urn:t" targetNamespace="urn:t">
  <message id="M" name="go"/>
  <process id="P"><receiveTask id="R" messageRef="${ref}"/></process></definitions>`;
for (const ref of ['M', 'tns:M']) {
  const moddle = new BpmnModdle();
  const { rootElement, warnings } = await moddle.fromXML(file(ref));
  const task = rootElement.rootElements[1].flowElements[0];
  const { xml } = await moddle.toXML(rootElement);
  console.log(ref, task.messageRef?.name, warnings.map((w) => w.message), /<\S*receiveTask[^>]*>/.exec(xml)[0]);
}
EOF
diff <(node try.mjs) - <<'EOF'
M go [] <receiveTask id="R" messageRef="M" />
tns:M undefined [ 'unresolved reference <tns:M>' ] <receiveTask id="R" />
EOF
echo "as seen: a reference with the prefix of the target namespace is not resolved and is lost when saved"
