#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (action, `do_orbit`), with pymavlink 2.4.50 in the part of the vehicle. Date: 2026-11-30.
# Expected: `do_orbit(..., absolute_altitude_m)` sends an altitude above sea level in a frame that says so:
#   COMMAND_INT DO_ORBIT (34) with MAV_FRAME_GLOBAL (0) or MAV_FRAME_GLOBAL_INT (5).
# Seen: the altitude above sea level as it is, and the frame MAV_FRAME_GLOBAL_RELATIVE_ALT (3), which CommandInt of
#   MAVSDK has by default (mavlink_command_sender.hpp).
# Matters: a vehicle that believes the frame climbs to 498 m above a home at 488 m for a circle meant at 10 m. PX4's
#   FlightTaskOrbit looks at no frame, so nothing is seen there.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavsdk==4.1.0 pymavlink==2.4.50

cat > try.py <<'EOF2'
import os, socket, threading, time
os.environ["MAVLINK20"] = "1"
from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.action import Action, OrbitYawBehavior
from pymavlink import mavutil

log_subscribe(lambda *_: True)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
    probe.bind(("127.0.0.1", 0))
    port = probe.getsockname()[1]
station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
station.add_any_connection(f"udpin://127.0.0.1:{port}")
link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1)
frames = {}


def vehicle():
    for _ in range(300):
        link.mav.heartbeat_send(2, 12, 81, 0, 4)
        message = link.recv_match(type="COMMAND_INT", blocking=True, timeout=0.1)
        if message is not None:
            frames[message.command] = (message.frame, message.z)
            link.mav.command_ack_send(message.command, 0)
            return


flying = threading.Thread(target=vehicle)
flying.start()
action = Action(station.first_autopilot(20))
action.do_orbit(10.0, 2.0, OrbitYawBehavior.HOLD_FRONT_TO_CIRCLE_CENTER, 47.4, 8.5, 498.0)
flying.join()
(command, (frame, z)), = frames.items()
print("command", command, "frame", frame, "altitude", z)
station.destroy()
EOF2
diff <(venv/bin/python try.py) - <<'EOF2'
command 34 frame 3 altitude 498.0
EOF2
echo "as seen: an orbit above sea level comes in a frame that is above home"
