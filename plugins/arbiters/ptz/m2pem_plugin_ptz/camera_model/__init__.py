"""Where a camera looks in the world, what of the ground it sees, and how to look over an area."""
