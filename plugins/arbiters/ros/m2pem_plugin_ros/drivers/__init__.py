"""The ways to reach a vehicle: an m2pem node on it, Nav2, or a plain base that is driven by us."""
