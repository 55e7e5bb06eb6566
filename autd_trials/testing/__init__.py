"""Tests of a rig without hardware: a stage in virtual time, scripted people, whole studies."""
