"""The formats of `m2pem export`: csv, parquet, geojson, kml, xes and mcap (docs/recording.md)."""
