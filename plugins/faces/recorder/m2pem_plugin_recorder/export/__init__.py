"""The formats of `m2pem export` (docs/recording.md)."""
