"""The folder of missions: what is in it, who saved it when, and what was there before."""
