"""Running a session: events, the runner, what it needs of devices and of the operator."""
