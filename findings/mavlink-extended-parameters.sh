#!/usr/bin/env bash
# Program: pymavlink 2.4.50, node-mavlink 2.3.0. Date: 2026-11-29.
# Expected: param_value of PARAM_EXT_VALUE carries the bytes of a value whose type is beside it, in 128 chars (MAVLink,
#   "Extended Parameter Protocol": parameter encoding): a reader gets all bytes.
# Seen: both end each field of chars at its first NUL. An INT32 of 256 or 65536 arrives as nothing, as 0 does. pymavlink
#   reads the rest as UTF-8, so that -1 becomes four replacement characters; it keeps the bytes in an attribute that is
#   private. node-mavlink does not keep them.
# Matters: exposure times, ISO numbers and other settings of MAVLink cameras are read as 0.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile pymavlink==2.4.50
npm install --silent --no-fund --no-audit node-mavlink@2.3.0 mavlink-mappings@1.0.21-20250824-1 >/dev/null

cat > try.py <<'EOF'
import struct
from pymavlink.dialects.v20 import common
camera = common.MAVLink(None, srcSystem=1, srcComponent=100)
frames = open("frames", "w")
for value in (5, 256, 65536, -1):
    field = struct.pack("<i", value).ljust(128, b"\0")
    message = camera.param_ext_value_encode(b"CAM_EXP", field, common.MAV_PARAM_EXT_TYPE_INT32, 1, 0)
    frame = bytes(message.pack(camera))
    print(frame.hex(), file=frames)
    received = common.MAVLink(None).parse_buffer(frame)[0]
    print("pymavlink", value, ascii(received.param_value))
EOF
cat > try.mjs <<'EOF'
import fs from 'node:fs'
import mavlink from 'node-mavlink'
for (const line of fs.readFileSync('frames', 'utf8').trim().split('\n')) {
  const splitter = new mavlink.MavLinkPacketSplitter()
  const parser = splitter.pipe(new mavlink.MavLinkPacketParser())
  const packet = await new Promise(resolve => { parser.on('data', resolve); splitter.write(Buffer.from(line, 'hex')) })
  const { paramValue } = packet.protocol.data(packet.payload, mavlink.common.ParamExtValue)
  console.log('node-mavlink', JSON.stringify([...paramValue].map(each => each.codePointAt(0))))
}
EOF
diff <(venv/bin/python try.py; node try.mjs) - <<'EOF'
pymavlink 5 '\x05'
pymavlink 256 ''
pymavlink 65536 ''
pymavlink -1 '\ufffd\ufffd\ufffd\ufffd'
node-mavlink [5]
node-mavlink []
node-mavlink []
node-mavlink [255,255,255,255]
EOF
echo "as seen: extended parameters end at their first zero byte"
