"""MAVLink 2 signing: keys, timestamps, and the checks of received frames (mavlink.io, "Message
Signing")."""
