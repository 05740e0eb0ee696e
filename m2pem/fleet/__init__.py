"""The fleet: vehicles, payloads, teams, and what a mission may ask of them."""
