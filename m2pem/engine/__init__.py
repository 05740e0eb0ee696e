"""The engine executes missions: inputs -> records -> commands. Pure: no clock, no random, no
I/O."""
