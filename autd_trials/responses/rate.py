"""How much a person can send, and what is sent by something that is out of order."""

from collections import deque

MOST_INPUTS, IN_S = 50, 1.0
"""More than that come from no person: a key held down repeats some 30 times a second."""

STUCK_ADVICE = "look for a button or a key that sticks, and check the box's protocol; then go on"


class Rate:
    """Notices inputs that come faster than a person can send them, in bounded memory."""

    def __init__(self) -> None:
        self._newest: deque[float] = deque(maxlen=MOST_INPUTS)

    def allows(self, time_s: float) -> bool:
        """Count an input and return whether it may be a person's; after one that may not, begin anew."""
        if len(self._newest) == MOST_INPUTS and time_s - self._newest[0] < IN_S:
            self._newest.clear()
            return False
        self._newest.append(time_s)
        return True
