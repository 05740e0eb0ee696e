"""Vehicles over MAVSDK, for sites that standardise on it (`connection: {driver: mavsdk}`).

MAVSDK owns the sockets and serial lines, sends the heartbeats and uploads missions. Drivers,
exchanges and behaviors are the same as without it.
"""
