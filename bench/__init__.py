"""What m2pem and other engines cost on the same graphs: `python -m bench` (docs/speed.md)."""
