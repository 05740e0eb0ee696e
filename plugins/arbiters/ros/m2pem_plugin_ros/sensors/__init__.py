"""The topics of vehicles, detectors and payloads, and the checks of their publishers."""
