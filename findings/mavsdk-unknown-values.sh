#!/usr/bin/env bash
# Program: mavsdk 4.1.0 (telemetry), with pymavlink 2.4.50 in the part of the vehicle. Date: 2026-11-29.
# Expected: where MAVLink's common.xml has a value for "unknown" (UINT16_MAX, -1), the telemetry plugin gives NaN, as it
#   does for the heading and the battery current; and a field named "percent" or "percentage" runs from 0 to 100, as
#   the battery's does and as the unit of VFR_HUD.throttle (%) is.
# Seen: an unknown hdop, course and speed arrive as 655.35 (the course in degrees, the speed in m/s), an unknown battery
#   charge as -1, an unknown voltage as 0 V. throttle_percentage runs from 0 to 1: 50 % on the link arrives as 0.5.
# Matters: "charge below 20 %" is true of a vehicle that does not measure it; a checker of ranges needs a rule a field.
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
from mavsdk.plugins.telemetry import Telemetry
from pymavlink import mavutil

log_subscribe(lambda *_: True)
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
    probe.bind(("127.0.0.1", 0))
    port = probe.getsockname()[1]
station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
station.add_any_connection(f"udpin://127.0.0.1:{port}")
send = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1, source_component=1).mav
found = []
waiting = threading.Thread(target=lambda: found.append(station.first_autopilot(20)))
waiting.start()
while waiting.is_alive():
    send.heartbeat_send(2, 12, 81, 0, 4)
    time.sleep(0.2)
telemetry, got = Telemetry(found[0]), {}
names = ["heading", "raw_gps", "battery", "fixedwing_metrics"]
for name in names:
    getattr(telemetry, f"subscribe_{name}")(lambda value, *_, name=name: got.__setitem__(name, value))
UNKNOWN = 65535
for _ in range(100):
    send.global_position_int_send(0, 100000000, 200000000, 100000, 30000, 0, 0, 0, UNKNOWN)
    send.gps_raw_int_send(0, 3, 100000000, 200000000, 100000, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, 9)
    send.battery_status_send(0, 0, 0, 32767, [UNKNOWN] * 10, -1, -1, -1, -1)
    send.vfr_hud_send(1, 2, 359, 50, 100, 1)
    if len(got) == len(names):
        break
    time.sleep(0.1)
gps, battery = got["raw_gps"], got["battery"]
print("heading", got["heading"].heading_deg, "current", battery.current_battery_a)
print(f"hdop {gps.hdop:.2f} course {gps.cog_deg:.2f} deg speed {gps.velocity_m_s:.2f} m/s")
print("charge", battery.remaining_percent, "voltage", battery.voltage_v)
print("throttle", got["fixedwing_metrics"].throttle_percentage)
station.destroy()
EOF
diff <(venv/bin/python try.py) - <<'EOF'
heading nan current nan
hdop 655.35 course 655.35 deg speed 655.35 m/s
charge -1.0 voltage 0.0
throttle 0.5
EOF
echo "as seen: unknown is NaN, 655.35, -1 or 0 depending on the field, and the throttle percentage ends at 1"
