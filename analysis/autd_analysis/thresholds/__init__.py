"""Thresholds, where an adaptive method chose the levels, and the planned comparisons of them."""
