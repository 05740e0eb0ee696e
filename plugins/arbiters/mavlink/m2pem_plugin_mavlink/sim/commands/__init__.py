"""Commands (MAV_CMD): taking them in, answering, and doing what no other part does."""
