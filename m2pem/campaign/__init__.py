"""Campaigns: one mission rehearsed many times, with drawn faults, times and conditions."""
