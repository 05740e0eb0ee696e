"""Tests of missions: scenarios beside a mission, what they cover, and what reaches the rest."""
