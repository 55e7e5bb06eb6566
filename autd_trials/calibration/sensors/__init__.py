"""Depth sensors: what watches the target."""
