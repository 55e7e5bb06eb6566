"""The experimenter's screens."""
