"""The formats of `m2pem export`: csv, parquet, geojson, kml, xes, mcap, rosbag2 (docs/recording.md)."""
