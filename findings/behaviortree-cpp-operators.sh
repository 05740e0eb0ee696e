#!/usr/bin/env bash
# Program: BehaviorTree.CPP 4.8.2, as built into the wheel behaviortreepy 0.1.4. Date: 2026-11-29.
# Expected: the scripting language of the trees (Script node, _skipIf, _failureIf) has the operators of C++, and with them
#   their grouping: 1 - 2 - 3 is -4, 100 / 10 / 5 is 2, and && binds closer than ||.
# Seen: + - and * / group from the right: 1 - 2 - 3 is 2, 2 - 3 + 4 is -5, 100 / 10 / 5 is 50. && and || have the same
#   rank and group from the left: true || false && false is false. With parentheses the values are right.
# Matters: left := 100 - used - reserve with 70 used and 20 in reserve gives 50 percent instead of 10.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile behaviortreepy==0.1.4
grep -qx 4.8.2 <(grep -aoE '4\.[0-9]+\.[0-9]+' venv/lib/python3*/site-packages/behaviortreepy/_behaviortreepy*.so)

cat > try.py <<'EOF'
from xml.sax.saxutils import quoteattr
import behaviortreepy

TREE = '<root BTCPP_format="4"><BehaviorTree ID="M"><Script code={}/></BehaviorTree></root>'
for text in ("1 - 2 - 3", "(1 - 2) - 3", "2 - 3 + 4", "100 / 10 / 5", "(100 / 10) / 5", "100 - 70 - 20",
             "true || false && false", "true || (false && false)"):
    tree = behaviortreepy.BehaviorTreeFactory().create_tree_from_text(TREE.format(quoteattr("b := " + text)))
    tree.tick_once()
    print(text, "=", tree.root_blackboard().get_double("b"))
EOF
diff <(venv/bin/python try.py) - <<'EOF'
1 - 2 - 3 = 2.0
(1 - 2) - 3 = -4.0
2 - 3 + 4 = -5.0
100 / 10 / 5 = 50.0
(100 / 10) / 5 = 2.0
100 - 70 - 20 = 50.0
true || false && false = 0.0
true || (false && false) = 1.0
EOF
echo "as seen: minus and division group from the right, and || binds as close as &&"
