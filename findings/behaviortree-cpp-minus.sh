#!/usr/bin/env bash
# Program: BehaviorTree.CPP 4.8.2, as built into the wheel behaviortreepy 0.1.4. Date: 2026-11-29.
# Expected: in the scripting language of the trees (Script node, _skipIf, _failureIf) operators of equal rank group
#   from the left, as in C++ and in arithmetic: 1 - 2 - 3 is -4 and 100 / 10 / 5 is 2.
# Seen: they group from the right: 1 - 2 - 3 is 2 and 100 / 10 / 5 is 50. With parentheses the values are right.
#   (7 / 2 is 3.5: whole numbers are not divided as integers.)
# Matters: battery := 100 - used - reserve with used 70 and reserve 20 gives 50 left instead of 10.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile behaviortreepy==0.1.4

cat > try.py <<'EOF'
import behaviortreepy

TREE = '<root BTCPP_format="4"><BehaviorTree ID="M"><Script code="b := {}"/></BehaviorTree></root>'
for text in ("1 - 2 - 3", "(1 - 2) - 3", "100 / 10 / 5", "(100 / 10) / 5", "100 - 70 - 20", "7 / 2"):
    tree = behaviortreepy.BehaviorTreeFactory().create_tree_from_text(TREE.format(text))
    tree.tick_once()
    print(text, "=", tree.root_blackboard().get_double("b"))
EOF
diff <(venv/bin/python try.py) - <<'EOF'
1 - 2 - 3 = 2.0
(1 - 2) - 3 = -4.0
100 / 10 / 5 = 50.0
(100 / 10) / 5 = 2.0
100 - 70 - 20 = 50.0
7 / 2 = 3.5
EOF
grep -qx 4.8.2 <(grep -aoE '4\.[0-9]+\.[0-9]+' venv/lib/python3*/site-packages/behaviortreepy/_behaviortreepy*.so)
echo "as seen: minus and division group from the right"
