#!/usr/bin/env bash
# Program: rasterio 1.4.4 with GDAL 3.10.3, pyproj 3.7.2. Date: 2026-11-29.
# Expected: a GeoTIFF that is written with a system of EPSG names that system's vertical datum when it is read: whether
#   the system came as a number, or as the WKT of pyproj for that number.
# Seen: by the number the datum is right. By pyproj's WKT the file names another one of that region: "Ibiza" for heights
#   above NAP in the Netherlands, "Newlyn (Orkney Isles)" for those of Great Britain, and one of 2025 of California for
#   NAVD88. The name of the vertical system itself stays right, its number is lost.
# Matters: a reader that judges by the datum refuses ground files of whole countries, or converts them by another grid.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv --without-pip venv
python3 -m pip --python venv/bin/python install -qq --no-compile rasterio==1.4.4 pyproj==3.7.2 numpy==2.4.6

cat > try.py <<'EOF'
import re
import numpy as np
import pyproj
import rasterio
from rasterio.crs import CRS
from rasterio.transform import from_origin
def read_back(crs):
    shape = dict(driver="GTiff", width=2, height=2, count=1, dtype="float32", transform=from_origin(0, 2, 1, 1))
    with rasterio.MemoryFile() as file:
        with file.open(crs=crs, **shape) as written:
            written.write(np.zeros((1, 2, 2), "float32"))
        with file.open() as read:
            return ": ".join(re.search(r'VERT_CS\["([^"]+)",VERT_DATUM\["([^"]+)"', read.crs.to_wkt()).groups())
for code in (7415, 7405, 6349):
    print(code, "by number,", read_back(CRS.from_epsg(code)))
    print(code, "by WKT,", read_back(pyproj.CRS.from_epsg(code).to_wkt()))
EOF
diff <(venv/bin/python -W ignore try.py) - <<'EOF'
7415 by number, NAP height: Normaal Amsterdams Peil
7415 by WKT, NAP height: Ibiza
7405 by number, ODN height: Ordnance Datum Newlyn
7405 by WKT, ODN height: Ordnance Datum Newlyn (Orkney Isles)
6349 by number, NAVD88 height: North American Vertical Datum 1988
6349 by WKT, NAVD88 height: Derived California Orthometric Heights of 1988 epoch 2025
EOF
echo "as seen: a GeoTIFF written by pyproj's WKT names the vertical datum of another place"
