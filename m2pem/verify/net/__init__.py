"""A mission as a Petri net: its places and transitions, and their encoding as integers."""
