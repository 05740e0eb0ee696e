#!/usr/bin/env bash
# Program: pyquaternion 0.9.9, compared with transforms3d 0.4.2. Date: 2026-11-29.
# Expected: Quaternion.yaw_pitch_roll gives, as its documentation says, the intrinsic z-y'-x'' angles, the convention of
#   aerospace, ROS and MAVLink: a quaternion built as yaw * pitch * roll gives back the yaw, pitch and roll put in.
# Seen: with one angle at a time it does. With all three it gives other angles: those of the order x-y'-z''. A quaternion
#   built as roll * pitch * yaw is the one that it takes apart.
# Matters: tests with one axis pass; a gimbal at yaw 30, pitch 20, roll 10 reads as 28.5, 22.2, -1.1 degrees.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile pyquaternion==0.9.9 transforms3d==0.4.2 numpy==2.4.6

cat > try.py <<'EOF'
from math import degrees
from pyquaternion import Quaternion
from transforms3d.euler import quat2euler

def show(name, q):
    print(name, "pyquaternion", *(f"{degrees(a):+.1f}" for a in q.yaw_pitch_roll),
          "transforms3d", *(f"{degrees(a):+.1f}" for a in quat2euler(q.elements, "rzyx")))

yaw = Quaternion(axis=[0, 0, 1], degrees=30)
pitch = Quaternion(axis=[0, 1, 0], degrees=20)
roll = Quaternion(axis=[1, 0, 0], degrees=10)
show("yaw", yaw)
show("pitch", pitch)
show("yaw*pitch*roll", yaw * pitch * roll)
show("roll*pitch*yaw", roll * pitch * yaw)
EOF
diff <(venv/bin/python try.py | sed 's/[+-]0\.0/0.0/g') - <<'EOF'
yaw pyquaternion +30.0 0.0 0.0 transforms3d +30.0 0.0 0.0
pitch pyquaternion 0.0 +20.0 0.0 transforms3d 0.0 +20.0 0.0
yaw*pitch*roll pyquaternion +28.5 +22.2 -1.1 transforms3d +30.0 +20.0 +10.0
roll*pitch*yaw pyquaternion +30.0 +20.0 +10.0 transforms3d +33.8 +11.8 +19.0
EOF
echo "as seen: yaw_pitch_roll takes the rotations in the opposite order to the one documented"
