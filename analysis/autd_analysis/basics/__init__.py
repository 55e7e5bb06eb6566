"""Intervals, paired tests, bootstrap, adjustment: arrays in, numbers out."""
