"""Streams of these tests are heard by these tests only."""

from tests.lsl import keep_to_ourselves

keep_to_ourselves()
