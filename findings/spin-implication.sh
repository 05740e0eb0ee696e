#!/usr/bin/env bash
# Program: Spin 6.5.2 (Debian package spin 6.5.2+dfsg-1), gcc. Date: 2026-11-29.
# Expected: in LTL "p -> q -> r" means p -> (q -> r), "if p, then if q, then r", as in logic books, and as in Spot and
#   NuSMV; "p U q U r" is p U (q U r) in Spot.
# Seen: Spin groups every binary operator from the left: (p -> q) -> r. With p, q and r all false the property below holds
#   for every other reader, and Spin reports a violation; with parentheses it finds none.
# Matters: a property that is copied from another tool is checked as a different one, and the text looks the same.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
if [ "$(spin -V 2>/dev/null | cut -d' ' -f3)" = 6.5.2 ]; then spin=spin; else
  apt-get download -qq spin=6.5.2+dfsg-1 >/dev/null
  dpkg -x spin_*.deb . && spin=$work/usr/bin/spin
fi

cat > try.pml <<'EOF'
bool p, q, r;
active proctype Idle() { skip }
ltl plain  { p -> q -> r }
ltl paired { p -> (q -> r) }
ltl until  { p U q U r }
EOF
"$spin" -a try.pml | grep '^ltl' > parsed
gcc -o pan pan.c
for name in plain paired; do
  echo "$name $(./pan -a -N "$name" | grep -o 'errors: [0-9]')" >> parsed
done
diff parsed - <<'EOF'
ltl plain: (! ((! (p)) || (q))) || (r)
ltl paired: (! (p)) || ((! (q)) || (r))
ltl until: ((p) U (q)) U (r)
plain errors: 1
paired errors: 0
EOF
echo "as seen: Spin reads p -> q -> r as (p -> q) -> r"
