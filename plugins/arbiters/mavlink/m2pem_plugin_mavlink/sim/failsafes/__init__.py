"""What a vehicle does by itself when the ground station, the battery or the position is lost."""
