"""What a study runs on: the rig file, and the devices built from it."""
