#!/usr/bin/env bash
# Program: fastkml 1.4.0. Date: 2026-11-29.
# Expected: in KML's coordinates the altitude of each tuple is optional, with 0 as its default (the KML reference:
#   "lon,lat[,alt]"), so "20,10 21,11,40" is a line with heights 0 and 40; or, with strict=True, an error.
# Seen: if some tuples have a height and others have none, the whole geometry is dropped. The placemark stays with its
#   name and without a geometry, and neither strict=True (the default) nor a warning says so.
# Matters: a route that was drawn on the ground and then raised at one point reads as an empty placemark.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile fastkml==1.4.0 pygeoif==1.6.0 lxml==6.1.3

cat > try.py <<'EOF'
from fastkml import KML
FILE = """<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>route</name>
  <LineString><coordinates>{}</coordinates></LineString></Placemark></Document></kml>"""
for text in ("20,10 21,11", "20,10,0 21,11,40", "20,10 21,11,40"):
    (placemark,) = KML.from_string(FILE.format(text), strict=True).features[0].features
    print(text, "->", placemark.name, placemark.geometry)
EOF
diff <(venv/bin/python try.py 2>&1) - <<'EOF'
20,10 21,11 -> route LINESTRING (20.0 10.0, 21.0 11.0)
20,10,0 21,11,40 -> route LINESTRING Z (20.0 10.0 0.0, 21.0 11.0 40.0)
20,10 21,11,40 -> route None
EOF
echo "as seen: a line with a height at one point only has no geometry"
