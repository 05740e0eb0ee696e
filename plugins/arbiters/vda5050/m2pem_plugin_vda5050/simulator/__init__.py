"""Simulated vehicles that speak VDA 5050: `m2pem sim vda5050`."""
