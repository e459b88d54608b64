"""Figures: how fast things are, beside what they are compared with."""
