"""Where inputs and records are kept: memory, SQLite."""
