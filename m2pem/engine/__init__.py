"""The token game: inputs -> records -> commands. Pure: no clock, no random, no I/O."""
