#!/usr/bin/env bash
# Program: rosbags 0.11.9 (pure Python reader and writer of ROS 2 bags), numpy 2.4.6. Date: 2026-11-29.
# Expected: an array of integers given for a float64 field, such as a covariance np.diag([1, 1, 0, 0, 0, 4]).ravel(), is
#   converted (as numpy does on assignment) or refused, as serialize_cdr() refuses float32 and int32 arrays.
# Seen: an array whose items have the same size as the field's is written bit for bit. int64 1 becomes 5e-324, so the
#   covariance reads as 0; big-endian floats (from a file of another machine) become noise. No error, no warning.
# Matters: the filter that reads the bag takes the pose for exact.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile rosbags==0.11.9 numpy==2.4.6

cat > try.py <<'EOF'
import numpy as np
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_JAZZY)
NAME = "geometry_msgs/msg/PoseWithCovariance"
point, quaternion, pose, message = (
    store.types[f"geometry_msgs/msg/{name}"] for name in ("Point", "Quaternion", "Pose", "PoseWithCovariance"))
at = pose(position=point(x=1.0, y=2.0, z=3.0), orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
for kind in ("float64", "float32", "int32", "int64", ">f8"):
    covariance = np.diag([1, 1, 0, 0, 0, 4]).ravel().astype(kind)
    try:
        read = store.deserialize_cdr(store.serialize_cdr(message(pose=at, covariance=covariance), NAME), NAME)
        print(kind, "first", read.covariance[0], "last", read.covariance[35])
    except Exception as error:
        print(kind, type(error).__name__)
EOF
diff <(venv/bin/python try.py) - <<'EOF'
float64 first 1.0 last 4.0
float32 ValueError
int32 ValueError
int64 first 5e-324 last 2e-323
>f8 first 3.03865e-319 last 2.0553e-320
EOF
echo "as seen: int64 items are written as the bits of a float64"
