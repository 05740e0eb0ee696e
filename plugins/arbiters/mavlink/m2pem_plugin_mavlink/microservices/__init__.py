"""The microservices of MAVLink (mavlink.io, "Microservices"), each without I/O."""
