#!/usr/bin/env bash
# Program: feelin 8.2.0 (the FEEL interpreter of bpmn.io's tools). Date: 2026-11-29.
# Expected: DMN's FEEL (general semantics of multiplication and division) multiplies and divides a duration by a number.
#   From 31 January to 28 February is no whole month, so "years and months duration" is P0M. P1M and P30D are of
#   different kinds, so "greater than" between them is null. 1e3 is 1000, as 1.5e3 is 1500, or an error.
# Seen: addition works; multiplication and division are null with a mere warning, and so is the comparison that uses
#   them. "years and months duration" gives P28D, a duration of the other kind; P1M > P30D is true; 1e3 is 1.
# Matters: a rule such as "flight time left / 2 > time home" is null, and a gateway takes null for false.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund feelin@8.2.0 >/dev/null

cat > try.mjs <<'EOF'
import { evaluate } from 'feelin';
for (const text of [
  'duration("PT1H") + duration("PT1H") = duration("PT2H")',
  'duration("PT1H") * 2',
  'duration("PT1H") / 2',
  'duration("PT1H") / 2 > duration("PT15M")',
  'string(years and months duration(date("2026-01-31"), date("2026-02-28")))',
  'duration("P1M") > duration("P30D")',
  '1.5e3',
  '1e3',
]) console.log(text, '=', JSON.stringify(evaluate(text, {}).value));
EOF
diff <(node try.mjs) - <<'EOF'
duration("PT1H") + duration("PT1H") = duration("PT2H") = true
duration("PT1H") * 2 = null
duration("PT1H") / 2 = null
duration("PT1H") / 2 > duration("PT15M") = null
string(years and months duration(date("2026-01-31"), date("2026-02-28"))) = "P28D"
duration("P1M") > duration("P30D") = true
1.5e3 = 1500
1e3 = 1
EOF
echo "as seen: durations are not multiplied or divided, months and days are mixed, and 1e3 is 1"
