"""Rehearsals: a mission on a virtual clock, with scripted answers and simulated vehicles."""
