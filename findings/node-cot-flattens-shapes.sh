#!/usr/bin/env bash
# Program: @tak-ps/node-cot 12.23.0. Date: 2026-11-29.
# Expected: CoT.from_geojson() of a Polygon or LineString keeps what a drawing in CoT can say: link points have the form
#   "lat,lon,hae", so the heights of the vertices stay. An inner ring, which a u-d-f drawing cannot say, is an error.
#   A position without a height becomes hae 9999999, CoT's value for "unknown", as ce and le do.
# Seen: heights of vertices and inner rings are dropped without a word; the centre gets hae 0.0, on the ellipsoid, with
#   an unknown error. The hole in a no-fly zone is closed.
# Matters: "fence with a corridor cut out" is shown to every TAK user as a closed fence on the ground.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm init -y >/dev/null
npm install --silent --no-audit --no-fund @tak-ps/node-cot@12.23.0 >/dev/null

cat > try.mjs <<'EOF'
import CoT from '@tak-ps/node-cot';
const feature = (type, coordinates) => (
  { id: 'F', type: 'Feature', properties: { callsign: 'F' }, geometry: { type, coordinates } });
for (const [name, input] of [
  ['line', feature('LineString', [[0, 0, 50], [0, 1, 60]])],
  ['polygon', feature('Polygon', [[[0, 0, 50], [0, 3, 50], [3, 3, 50], [0, 0, 50]],
    [[1, 1.5, 50], [1, 2, 50], [1.5, 2, 50], [1, 1.5, 50]]])],
  ['point', feature('Point', [20, 10])],
]) {
  const xml = CoT.from_geojson(input).to_xml();
  console.log(name, /hae="[^"]*" ce="[^"]*"/.exec(xml)[0],
    [...xml.matchAll(/link point="([^"]*)"/g)].map((m) => m[1]).join(' '));
}
EOF
diff <(node try.mjs) - <<'EOF'
line hae="0.0" ce="9999999.0" 0,0 1,0
polygon hae="0.0" ce="9999999.0" 0,0 3,0 3,3 0,0
point hae="0.0" ce="9999999.0" 
EOF
echo "as seen: heights and holes are gone, and an unknown height is 0"
