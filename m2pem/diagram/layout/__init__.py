"""Where the symbols of a file without a diagram go: a grid in which tokens flow to the right."""
