"""MAVLink without I/O: messages, frames, transactions. Knows no vehicle and no clock."""
