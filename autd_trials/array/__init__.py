"""The phased array: units and their poses, envelopes, the driver interface and its drivers."""
