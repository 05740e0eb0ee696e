"""MAVLink without I/O: messages, frames, exchanges. Knows no vehicle and no clock."""
