"""Demonstrations on simulated vehicles: `m2pem demo` (docs/cli.md)."""
