#!/usr/bin/env bash
# Program: ipycam 1.3.0, an ONVIF camera in Python. Date: 2026-11-29.
# Expected: PTZ requests are read as the XML that they are (ONVIF PTZ service specification, ver20/ptz/wsdl): an
#   AbsoluteMove that has only a Zoom in its Position leaves pan and tilt alone, whatever its Speed holds; the order of
#   attributes is free; a ContinuousMove ends by itself after its Timeout.
# Seen: the requests are searched with regular expressions. The PanTilt of the Speed is taken as the position, so a
#   zoom turns the camera to the end of its range; <PanTilt y=".." x=".."> is ignored; after a Timeout of 0.5 s the
#   camera still moves. Each request is answered as carried out.
# Matters: a driver that passes against this camera, or fails, has not been tested against ONVIF.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile --no-deps \
  ipycam==1.3.0 numpy==2.4.6 opencv-python-headless==4.13.0.92

cat > try.py <<'EOF'
import time
from ipycam import CameraConfig, ONVIFService, PTZController

BODY = '<s:Envelope xmlns:s="http://www.w3.org/2003/05/soap-envelope" xmlns:t="http://www.onvif.org/ver10/schema"><s:Body>' \
       '<{0} xmlns="http://www.onvif.org/ver20/ptz/wsdl"><ProfileToken>p</ProfileToken>{1}</{0}></s:Body></s:Envelope>'

def after(action, content, wait_s=0.0):
    ptz = PTZController()
    camera = ONVIFService(CameraConfig(), ptz)
    assert f"{action}Response" in camera.handle_action(action, BODY.format(action, content))
    time.sleep(wait_s)
    status = ptz.get_status()
    ptz.stop()
    return status

where = lambda s: (s["pan"], s["tilt"], s["zoom"])
print("zoom", where(after("AbsoluteMove", '<Position><t:Zoom x="0.2"/></Position>')))
print("zoom with speed", where(after("AbsoluteMove",
      '<Position><t:Zoom x="0.2"/></Position><Speed><t:PanTilt x="1" y="1"/></Speed>')))
print("x y", where(after("AbsoluteMove", '<Position><t:PanTilt x="0.5" y="-0.5"/></Position>')))
print("y x", where(after("AbsoluteMove", '<Position><t:PanTilt y="-0.5" x="0.5"/></Position>')))
print("1.5 s after a timeout of 0.5 s moving:",
      after("ContinuousMove", '<Velocity><t:PanTilt x="0.1" y="0"/></Velocity><Timeout>PT0.5S</Timeout>', 2.0)["moving"])
EOF
diff <(venv/bin/python try.py) - <<'EOF'
zoom (0.0, 0.0, 0.2)
zoom with speed (1.0, 1.0, 0.2)
x y (0.5, -0.5, 0.0)
y x (0.0, 0.0, 0.0)
1.5 s after a timeout of 0.5 s moving: True
EOF
echo "as seen: the speed is taken as the position, attributes must be in order, and the timeout does nothing"
