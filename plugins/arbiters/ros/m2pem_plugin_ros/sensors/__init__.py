"""What the topics of vehicles, detectors and payloads say, and who publishes on them."""
