"""The fence: its shapes (`zones`), and what happens at it (`fence`)."""
