"""The built-in search of a net's state space, and what it may leave out."""
