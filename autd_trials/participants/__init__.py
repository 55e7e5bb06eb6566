"""Simulated people; one is a responder like any other."""
