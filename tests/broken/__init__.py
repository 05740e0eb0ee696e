"""The broken missions of docs/broken: what is to be found in each, and their pictures."""
