"""Sensor nodes on a network: what units' computers send by Lab Streaming Layer, and how it is collected."""
