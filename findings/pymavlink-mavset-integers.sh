#!/usr/bin/env bash
# Program: pymavlink 2.4.50 (mavparm). Date: 2026-11-29.
# Expected: MAVParmDict.mavset(link, name, value, parm_type=...) sets an integer parameter on ArduPilot, whose own
#   project pymavlink is. MAVLink's parameter protocol has two encodings; ArduPilot's is "C cast": 1500 goes as 1500.0.
# Seen: as soon as the type is given, mavset sends the bytes of the integer ("bytewise", the encoding of PX4), whatever
#   the autopilot: PARAM_SET carries 2.1e-42 for 1500. Without the type it sends 1500.0, right for ArduPilot only.
# Matters: with the type, which PARAM_SET requires, an ArduPilot gets a value that it rounds to 0, such as RTL_ALT.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile pymavlink==2.4.50

cat > try.py <<'EOF'
import os, struct
os.environ["MAVLINK20"] = "1"
from pymavlink import mavparm, mavutil

class Vehicle:
    """Takes PARAM_SET and answers at once, as an autopilot does."""
    def param_set_send(self, name, value, parm_type=None):
        message = mavutil.mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, parm_type or 0)
        self.frame = message.pack(mavutil.mavlink.MAVLink(None, srcSystem=255))
    def recv_match(self, **_):
        (got,) = mavutil.mavlink.MAVLink(None).parse_buffer(self.frame)
        print(f"  on the link {got.param_value:.4g}, cast to int {int(got.param_value)}, bytes", 
              struct.unpack("<i", struct.pack("<f", got.param_value))[0])
        return mavutil.mavlink.MAVLink_param_value_message(got.param_id.encode(), got.param_value, got.param_type, 1, 0)

parameters = mavparm.MAVParmDict()
for parm_type in (None, mavutil.mavlink.MAV_PARAM_TYPE_INT32):
    print("type", parm_type)
    parameters.mavset(Vehicle(), "RTL_ALT", 1500, parm_type=parm_type)
EOF
diff <(venv/bin/python try.py) - <<'EOF'
type None
  on the link 1500, cast to int 1500, bytes 1153138688
type 6
  on the link 2.102e-42, cast to int 0, bytes 1500
EOF
echo "as seen: with the parameter's type mavset always sends the bytes of the integer, which ArduPilot reads as 0"
