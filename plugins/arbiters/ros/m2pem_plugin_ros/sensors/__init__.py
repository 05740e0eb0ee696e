"""What the topics of vehicles, detectors and payloads report, and who publishes on them."""
