#!/usr/bin/env bash
# Program: NavPy 1.0. Date: 2026-11-29.
# Expected: ecef2lla(), and ned2lla() that builds on it, give latitude, longitude and altitude of each point on earth;
#   their docstrings name no exception.
# Seen: on the equator the latitude is NaN (the iteration divides by z), and at a pole the altitude is 6,400 km below
#   the ground (it divides by the cosine of the latitude). A NaN ends the iteration as convergence does: no warning of
#   the library says so.
# Matters: a local frame whose origin is on the equator gives vehicles without a latitude; in an array of points the
#   others are not affected, so that it is seen only at that one.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile NavPy==1.0 numpy==2.4.6

cat > try.py <<'EOF'
import navpy
def shown(place):
    return " ".join(f"{float(each):.4f}" for each in place)
print("back and forth at 1 N", shown(navpy.ecef2lla(navpy.lla2ecef(1, 20, 100))))
print("back and forth at 0 N", shown(navpy.ecef2lla(navpy.lla2ecef(0, 20, 100))))
print("1 km east of 0 N, 20 E", shown(navpy.ned2lla([0, 1000, 0], 0, 20, 0)))
print("100 m above the pole", shown(navpy.ecef2lla([0, 0, 6356752.3142 + 100])))
EOF
diff <(venv/bin/python -W ignore try.py) - <<'EOF'
back and forth at 1 N 1.0000 20.0000 100.0000
back and forth at 0 N nan 20.0000 100.0000
1 km east of 0 N, 20 E nan 20.0090 0.0784
100 m above the pole 90.0000 0.0000 -6399593.6258
EOF
echo "as seen: the equator has no latitude, and a pole is 6,400 km below the ground"
