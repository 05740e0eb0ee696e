"""Geometry on the Earth: local frames, polylines, polygons, the fence, and files of geometries."""
