#!/usr/bin/env bash
# Program: AHRS 0.4.0. Date: 2026-11-29.
# Expected: DCM(rpy=...) and Quaternion(rpy=...), documented both as "roll-pitch-yaw angles", are one rotation. A frame
#   that llf2ecef(lat, lon) gives at 45 N 77 W has its up axis along the vertical there, and angles are degrees, as they
#   are in geodetic2ecef() and geodetic2enu() beside it.
# Seen: DCM takes the first angle about z, so that 90 degrees of roll are 90 degrees of yaw; its to_rpy() does not give
#   back what it was made of. llf2ecef() takes radians, and has latitude and longitude changed over: its up axis is
#   141 degrees off the vertical.
# Matters: an attitude that is built as a matrix rather than as a quaternion turns the vehicle instead of banking it.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile AHRS==0.4.0 numpy==2.4.6

cat > try.py <<'EOF'
import numpy as np
from ahrs import DCM, Quaternion
from ahrs.common.frames import geodetic2ecef, llf2ecef
def shown(values):
    return " ".join(f"{float(each) + 0.0:.2f}" for each in np.round(values, 6))
roll = [np.pi / 2, 0, 0]
print("y after Quaternion", shown(Quaternion(rpy=roll).to_DCM() @ [0, 1, 0]))
print("y after DCM", shown(np.asarray(DCM(rpy=roll)) @ [0, 1, 0]))
print("0.1 0.2 0.3 as DCM", shown(DCM(rpy=[0.1, 0.2, 0.3]).to_rpy()))
print("as Quaternion", shown(Quaternion(rpy=[0.1, 0.2, 0.3]).to_angles()))
lat, lon = np.radians([45, -77])
vertical = [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]
above = np.subtract(geodetic2ecef(45, -77, 1000), geodetic2ecef(45, -77, 0)) / 1000
for name, up in (
    ("geodetic2ecef", above),
    ("llf2ecef(lat, lon)", llf2ecef(lat, lon)[:, 2]),
    ("llf2ecef(lon, lat)", llf2ecef(lon, lat)[:, 2]),
):
    print(name, f"{np.degrees(2 * np.arcsin(np.linalg.norm(np.subtract(up, vertical)) / 2)):.0f} degrees off")
EOF
diff <(venv/bin/python try.py) - <<'EOF'
y after Quaternion 0.00 0.00 1.00
y after DCM -1.00 0.00 0.00
0.1 0.2 0.3 as DCM -0.29 -0.22 -0.04
as Quaternion 0.10 0.20 0.30
geodetic2ecef 0 degrees off
llf2ecef(lat, lon) 141 degrees off
llf2ecef(lon, lat) 0 degrees off
EOF
echo "as seen: DCM(rpy) takes yaw, pitch, roll, and llf2ecef has latitude and longitude changed over"
