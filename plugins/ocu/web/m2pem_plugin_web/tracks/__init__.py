"""Where vehicles and payloads were in each run: what the journal, which has no telemetry, lacks."""
