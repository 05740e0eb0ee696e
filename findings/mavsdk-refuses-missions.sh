#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (mission_raw), with pymavlink 2.4.50 in the part of the vehicle. Date: 2026-11-29.
# Expected: import_mission_planner_mission_from_string() reads what Mission Planner, a Windows program, and mavros
#   write: "QGC WPL 110" with CR LF. import_qgroundcontrol_mission_from_string() reads a plan without geoFence and
#   rallyPoints: QGroundControl's "Plan File Format" calls both optional.
# Seen: both are refused with FAILED_TO_PARSE_..., without a place or a reason. The same text with LF, and the same
#   plan with an empty fence and an empty list of rally points, are read.
# Matters: files from the tool that the function is named after fail; whoever generates plans must write empty members.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile mavsdk==4.1.0 pymavlink==2.4.50

cat > try.py <<'EOF'
import json, os, socket, threading, time
os.environ["MAVLINK20"] = "1"
from mavsdk import ComponentType, Configuration, Mavsdk, log_subscribe
from mavsdk.plugins.mission_raw import MissionRaw
from pymavlink import mavutil

WPL = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t10\t20\t488\t1\n1\t0\t3\t16\t0\t0\t0\t0\t10.1\t20.1\t30\t1\n"
ITEM = {"type": "SimpleItem", "autoContinue": True, "frame": 3, "command": 16, "doJumpId": 1,
        "params": [0, 0, 0, None, 10.1, 20.1, 30]}
PLAN = {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": {"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
                    "plannedHomePosition": [10, 20, 488], "items": [ITEM]}}
FENCE = {"geoFence": {"version": 2, "circles": [], "polygons": []}}
RALLY = {"rallyPoints": {"version": 2, "points": []}}
log_subscribe(lambda *_: True)
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
    vehicle.mav.heartbeat_send(2, 12, 81, 0, 4)
    time.sleep(0.2)
raw = MissionRaw(found[0])
for name, read, text in [
    ("waypoints, LF", raw.import_mission_planner_mission_from_string, WPL),
    ("waypoints, CR LF", raw.import_mission_planner_mission_from_string, WPL.replace("\n", "\r\n")),
    ("plan, fence and rally", raw.import_qgroundcontrol_mission_from_string, json.dumps(PLAN | FENCE | RALLY)),
    ("plan, no rally", raw.import_qgroundcontrol_mission_from_string, json.dumps(PLAN | FENCE)),
    ("plan, no fence", raw.import_qgroundcontrol_mission_from_string, json.dumps(PLAN | RALLY)),
]:
    try:
        print(name, len(read(text).mission_items))
    except Exception as error:
        print(name, str(error).partition(";")[0])
station.destroy()
EOF
diff <(venv/bin/python try.py) - <<'EOF'
waypoints, LF 2
waypoints, CR LF FAILED_TO_PARSE_MISSION_PLANNER_PLAN
plan, fence and rally 1
plan, no rally FAILED_TO_PARSE_QGC_PLAN
plan, no fence FAILED_TO_PARSE_QGC_PLAN
EOF
echo "as seen: CR LF waypoint files and plans without a fence or rally points are refused"
