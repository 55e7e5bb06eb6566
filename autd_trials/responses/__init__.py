"""How an answer comes in: keyboard, serial boxes."""
