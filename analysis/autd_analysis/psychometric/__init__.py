"""Psychometric functions: how the chance of "felt" rises along a quantity of the stimulus."""
