#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (mission_raw), with pymavlink 2.4.50 in the part of the vehicle. Date: 2026-11-29.
# Expected: in a QGroundControl plan DO_JUMP (177) names the doJumpId of its target, which counts from 1 ("Plan File
#   Format", SimpleItem). A PX4 mission has no home item, so the item with doJumpId 2 gets sequence number 1, and an
#   import for PX4 has to write the jump as "to 1". The plan also holds the geofence's breachReturn.
# Seen: the id is copied as if it were a sequence number. On PX4 every jump leads one item too far (here to itself);
#   on ArduPilot, where home is put in front, it is right. breachReturn is lost without a word: no item 5000.
# Matters: the loop that a pilot drew in QGroundControl is another one in the air, depending on the autopilot.
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

def item(number, command, *params):
    return {"type": "SimpleItem", "autoContinue": True, "frame": 3, "command": command, "doJumpId": number, "params": params}

PLAN = {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": {"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15, "hoverSpeed": 5,
                    "plannedHomePosition": [10, 20, 488],
                    "items": [item(1, 22, 0, 0, 0, None, 10, 20, 30), item(2, 16, 0, 0, 0, None, 10.1, 20.1, 30),
                              item(3, 177, 2, 5, 0, 0, 0, 0, 0), item(4, 20, 0, 0, 0, 0, 0, 0, 0)]},
        "geoFence": {"version": 2, "polygons": [], "breachReturn": [10.05, 20.05, 40],
                     "circles": [{"version": 1, "inclusion": True, "circle": {"center": [10, 20], "radius": 900}}]},
        "rallyPoints": {"version": 2, "points": []}}
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
    data = MissionRaw(found[0]).import_qgroundcontrol_mission_from_string(json.dumps(PLAN))
    (jump,) = [i for i in data.mission_items if i.command == 177]
    (meant,) = [i for i in data.mission_items if i.command == 16 and i.x == 101000000]
    print(name, "jump is item", jump.seq, "and leads to", int(jump.param1), "meant is", meant.seq)
    print("  fence", [i.command for i in data.geofence_items])
    station.destroy()
EOF
diff <(venv/bin/python try.py) - <<'EOF'
PX4 jump is item 2 and leads to 2 meant is 1
  fence [5003]
ArduPilot jump is item 3 and leads to 2 meant is 2
  fence [5003]
EOF
echo "as seen: on PX4 the jump leads to itself instead of the waypoint, and the breach return point is gone"
