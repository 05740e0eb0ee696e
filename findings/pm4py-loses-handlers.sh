#!/usr/bin/env bash
# Program: pm4py 2.7.23.11. Date: 2026-11-29.
# Expected: convert_to_petri_net() of a BPMN model covers what read_bpmn() has read, or refuses it: a timer boundary event
#   gives the net a second way out of its task, and a sub-process is replaced by its contents.
# Seen: both are read without a warning, and the net falls into two parts, one of which never gets a token: the handler
#   of the boundary event cannot fire, and neither can anything that comes after the sub-process.
# Matters: reachability and conformance checks answer as if the handler, or the rest of the mission, did not exist.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile --no-deps pm4py==2.7.23.11 lxml==6.1.3 \
  networkx==3.6.1 numpy==2.4.6 packaging==26.4 pandas==3.1.1 python-dateutil==2.9.0.post0 pytz==2026.6 six==1.17.0

flow() { echo "<sequenceFlow id=\"$1$2\" sourceRef=\"$1\" targetRef=\"$2\"/>"; }
head='<definitions xmlns="http://www.omg.org/spec/BPMN/20100524/MODEL" targetNamespace="urn:t"><process id="P">'
cat > boundary.bpmn <<EOF
$head<startEvent id="S"/>$(flow S A)<task id="A" name="fly"/>$(flow A E)<endEvent id="E"/>
<boundaryEvent id="B" attachedToRef="A"><timerEventDefinition/></boundaryEvent>
$(flow B R)<task id="R" name="land"/>$(flow R F)<endEvent id="F"/>
</process></definitions>
EOF
cat > sub.bpmn <<EOF
$head<startEvent id="S"/>$(flow S A)<subProcess id="A">
<startEvent id="s"/>$(flow s I)<task id="I" name="look"/>$(flow I e)<endEvent id="e"/></subProcess>
$(flow A B)<task id="B" name="fly"/>$(flow B E)<endEvent id="E"/></process></definitions>
EOF
cat > try.py <<'EOF'
import pm4py
from pm4py.objects.petri_net.semantics import enabled_transitions, execute
for name in ("boundary", "sub"):
    net, marking, _ = pm4py.convert_to_petri_net(pm4py.read_bpmn(f"{name}.bpmn"))
    fired, waiting = set(), [marking]
    seen = set()
    while waiting:
        now = waiting.pop()
        for transition in enabled_transitions(net, now):
            fired.add(transition)
            after = execute(transition, net, now)
            if after not in seen:
                seen.add(after)
                waiting.append(after)
    labels = lambda transitions: sorted(t.label for t in transitions if t.label)
    print(name, "can fire", labels(fired), "cannot", labels(net.transitions - fired))
EOF
diff <(venv/bin/python try.py 2>/dev/null | grep 'can fire') - <<'EOF'
boundary can fire ['fly'] cannot ['land']
sub can fire ['look'] cannot ['fly']
EOF
echo "as seen: the handler of a boundary event, and what follows a sub-process, can never fire"
