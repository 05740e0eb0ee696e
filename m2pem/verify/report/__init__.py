"""Reports: what verification found, for people in the words of the diagram, and for programs."""
