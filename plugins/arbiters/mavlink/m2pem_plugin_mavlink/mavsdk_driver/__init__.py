"""Vehicles over MAVSDK, for sites that standardise on it (`connection: {driver: mavsdk}`).

MAVSDK owns the sockets and serial lines, sends the heartbeats and uploads missions. How autopilots
are driven, what is exchanged with them and what is offered, is the same as without it.
"""
