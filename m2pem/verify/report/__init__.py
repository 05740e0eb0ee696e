"""Tells what verification found: to people, in the words of the diagram, and to programs."""
