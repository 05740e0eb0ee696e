#!/usr/bin/env bash
# Program: feelin 8.2.0 (npm), the interpreter of FEEL that bpmn.io's editors have. Date: 2026-11-30.
# Expected: a date and a time of day have no difference, and a time of day and a duration of years have none (DMN 1.5,
#   table 57): null. A time with an offset and one without are not subtracted: null.
# Seen: the difference of a date and a time of day is the time since 1970-01-01 less that; the offset is left out; a
#   time that has both an offset and a zone, which FEEL does not read, loses the offset.
# Matters: a mistaken operand of a timer or a condition gives a duration of decades, or the other flow, and no error.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund feelin@8.2.0

cat > try.mjs <<'EOF'
import { evaluate } from 'feelin';
for (const text of ['@"2021-01-01" - @"10:10:10"', '@"10:10:10" - @"P1Y"', '@"2021-01-02T10:10:10+02:00" - @"2021-01-01T10:10:10"',
  'time("13:20:00+05:00@Europe/Paris")']) {
  console.log(text, String(evaluate(text).value));
}
EOF
diff <(node try.mjs) - <<'EOF'
@"2021-01-01" - @"10:10:10" P18627DT13H49M50S
@"10:10:10" - @"P1Y" 10:10:10
@"2021-01-02T10:10:10+02:00" - @"2021-01-01T10:10:10" P1D
time("13:20:00+05:00@Europe/Paris") 13:20:00@Europe/Paris
EOF
echo "as seen: a date less a time of day is a duration since 1970"
