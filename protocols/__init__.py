"""The shipped protocols and rig files, found by bare name."""
