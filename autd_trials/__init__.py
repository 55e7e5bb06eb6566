"""Experiment runner for midair haptics with phased arrays of ultrasound transducers."""
