"""The folder of missions, and the versions of each."""
