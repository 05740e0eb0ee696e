#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (mission_raw), with pymavlink 2.4.50 in the part of an ArduPilot vehicle. Date: 2026-11-29.
# Expected: a "QGC WPL 110" file, as Mission Planner writes it, already has home as item 0 (the ArduPilot convention).
#   import_mission_planner_mission_from_string() gives back the items of the file.
# Seen: while the connected autopilot is an ArduPilot, the import puts home in front once more (frame 5, current).
#   The file's own home becomes item 1, a waypoint at the height above sea level of the home, and each DO_JUMP (177)
#   keeps its number and so jumps to the item before the one that was meant.
# Matters: the same file imported with a PX4 connected is right; with the autopilot that the format comes from it is not.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavsdk==4.1.0 pymavlink==2.4.50

cat > try.py <<'EOF'
import os, socket, threading, time
os.environ["MAVLINK20"] = "1"
from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.mission_raw import MissionRaw
from pymavlink import mavutil

FILE = "QGC WPL 110\n" + "".join("\t".join(map(str, row)) + "\n" for row in [
    (0, 1, 0, 16, 0, 0, 0, 0, 10.0, 20.0, 488.0, 1),
    (1, 0, 3, 22, 0, 0, 0, 0, 10.0, 20.0, 30.0, 1),
    (2, 0, 3, 16, 0, 0, 0, 0, 10.1, 20.1, 30.0, 1),
    (3, 0, 3, 177, 2, 5, 0, 0, 0, 0, 0, 1),
])
log_subscribe(lambda *_: True)
for name, autopilot in [("PX4", 12), ("ArduPilot", 3)]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    station.add_any_connection(f"udpin://127.0.0.1:{port}")
    vehicle = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1)
    found = []
    waiting = threading.Thread(target=lambda: found.append(station.first_autopilot(20)))
    waiting.start()
    while waiting.is_alive():
        vehicle.mav.heartbeat_send(2, autopilot, 81, 0, 4)
        time.sleep(0.2)
    data = MissionRaw(found[0]).import_mission_planner_mission_from_string(FILE)
    print(name, *((i.seq, i.frame, i.command, i.param1, i.z) for i in data.mission_items), sep="\n  ")
    station.destroy()
EOF
diff <(venv/bin/python try.py) - <<'EOF'
PX4
  (0, 0, 16, 0.0, 488.0)
  (1, 3, 22, 0.0, 30.0)
  (2, 3, 16, 0.0, 30.0)
  (3, 3, 177, 2.0, 0.0)
ArduPilot
  (0, 5, 16, 0.0, 488.0)
  (1, 0, 16, 0.0, 488.0)
  (2, 3, 22, 0.0, 30.0)
  (3, 3, 16, 0.0, 30.0)
  (4, 3, 177, 2.0, 0.0)
EOF
echo "as seen: 4 items of the file become 5, home twice, and the jump to item 2 leads to the takeoff"
