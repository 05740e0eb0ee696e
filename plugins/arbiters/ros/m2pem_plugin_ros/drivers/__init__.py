"""The drivers of vehicles: an m2pem node on the vehicle, Nav2, or a plain base."""
