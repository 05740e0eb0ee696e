#!/usr/bin/env bash
# Program: pymap3d 3.2.0. Date: 2026-11-29.
# Expected: vincenty.vreckon() keeps longitudes in -180..180: its docstring says that lon2 is "always converted" to that
#   interval, and track2() builds on it. lox.loxodrome_inverse() from 179 E to 179 W measures the 2 degrees between
#   them, as vincenty.vdist() does.
# Seen: every western longitude comes back as 180..360 (20 W, 1 km further east, is 340.009), which MAVLink's int32 of
#   1e-7 degrees cannot hold; and the rhumb line over the antimeridian is 19,516 km long instead of 219 km.
# Matters: a survey in the western hemisphere gets waypoints beyond the limits; near Fiji a leg goes around the world.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile pymap3d==3.2.0 numpy==2.4.6

cat > try.py <<'EOF'
from pymap3d import lox, vincenty
print("vreckon", *(f"{vincenty.vreckon(10, lon, 1000, 90)[1]:.3f}" for lon in (20, -20)))
print("track2", *(f"{lon:.0f}" for lon in vincenty.track2(10, -20, 10, -10, npts=3)[1]))
print("vdist", f"{vincenty.vdist(10, 179, 10, -179)[0] / 1000:.0f} km")
print("loxodrome", f"{lox.loxodrome_inverse(10, 179, 10, -179)[0] / 1000:.0f} km")
EOF
diff <(venv/bin/python try.py) - <<'EOF'
vreckon 20.009 340.009
track2 340 345 350
vdist 219 km
loxodrome 19516 km
EOF
echo "as seen: western longitudes leave as 180..360, and a rhumb line does not cross the antimeridian"
