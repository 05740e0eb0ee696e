"""Which room aircraft take up by what they do, so that two never plan into the same."""
