#!/usr/bin/env bash
# Program: pyais 3.3.1. Date: 2026-11-29.
# Expected: what is left out of a message is sent as "not available", as ITU-R M.1371-5 has it (annex 8, tables 48 and
#   70): latitude 91, longitude 181, speed 102.3 knots, course 360, heading 511; draught 0 and time 24:60:60 likewise.
#   Status and rate of turn are sent so.
# Seen: position, speed, course, heading and time are sent as zeros: a ship without a position is at 0 N 0 E, stopped,
#   with its bow to north, on the first of January 1970.
# Matters: a boat of a fleet that has no fix yet is drawn in the Gulf of Guinea by each receiver, as a valid position.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile pyais==3.3.1

cat > try.py <<'EOF'
from pyais import decode, encode_dict
seen = decode(*encode_dict({"type": 1, "mmsi": 366000001})).asdict()
print("status", int(seen["status"]), "place", seen["lat"], seen["lon"])
print("speed", seen["speed"], "course", seen["course"], "heading", seen["heading"])
base = decode(*encode_dict({"type": 4, "mmsi": 3669999})).asdict()
print("base station", base["year"], base["month"], base["day"], base["hour"], base["lat"], base["lon"])
EOF
diff <(venv/bin/python try.py) - <<'EOF'
status 15 place 0.0 0.0
speed 0.0 course 0.0 heading 0
base station 1970 1 1 0 0.0 0.0
EOF
echo "as seen: an AIS message without a position says 0 N 0 E, not 'not available'"
