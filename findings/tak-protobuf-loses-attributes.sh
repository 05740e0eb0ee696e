#!/usr/bin/env bash
# Programs: takproto 3.0.1 (under pytak) and @tak-ps/node-cot 12.23.0 (under CloudTAK). Date: 2026-11-29.
# Expected: TAK protocol version 1 has typed fields for a few attributes of contact, track, status and others. An element
#   with any further attribute has to travel whole as text in xmlDetail: detail.proto, of which both packages are built,
#   forbids to put part of an element into a typed message.
# Seen: both move the attributes that have a field and drop the others of the same element without a word: contact's
#   phone, track's slope, status's readiness. Elements without any typed field (here sensor) are kept whole.
# Matters: what a vehicle reports depends on whether the server asked for XML or for protobuf.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile takproto==3.0.1
npm init -y >/dev/null
npm install --silent --no-audit --no-fund @tak-ps/node-cot@12.23.0 >/dev/null

cat > event.xml <<'EOF'
<event version="2.0" uid="U1" type="a-f-G-U-C" how="m-g" time="2026-11-29T12:00:00.000Z"
  start="2026-11-29T12:00:00.000Z" stale="2026-11-29T12:05:00.000Z"><point lat="10" lon="20" hae="100" ce="5" le="7"/><detail>
  <contact callsign="R1" phone="5550100"/><track course="10" speed="2.5" slope="3"/>
  <status battery="55" readiness="true"/><sensor azimuth="30"/>
</detail></event>
EOF
cat > try.py <<'EOF'
from takproto import parse_proto, xml2proto
detail = parse_proto(xml2proto(open("event.xml").read())).cotEvent.detail
print("takproto", [word for word in ("R1", "phone", "2.5", "slope", "55", "readiness", "azimuth") if word in str(detail)])
EOF
cat > try.mjs <<'EOF'
import CoT from '@tak-ps/node-cot';
import { readFileSync } from 'node:fs';
const detail = CoT.from_proto(new CoT(readFileSync('event.xml', 'utf8').trim()).to_proto()).to_xml();
const words = ['R1', 'phone', '2.5', 'slope', '55', 'readiness', 'azimuth'];
console.log('node-cot', words.filter((word) => detail.replace(/<point[^>]*>/, '').includes(word)));
EOF
diff <(venv/bin/python try.py && node try.mjs) - <<'EOF'
takproto ['R1', '2.5', '55', 'azimuth']
node-cot [ 'R1', '2.5', '55', 'azimuth' ]
EOF
echo "as seen: phone, slope and readiness do not arrive"
