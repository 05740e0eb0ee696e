"""What a vehicle does in a mode, one module a maneuver: it says what its body is to do."""
