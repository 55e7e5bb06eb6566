"""Handing over from a reader thread."""

import math
import threading

import pytest

from autd_trials.clock import RealClock
from autd_trials.errors import DeviceError
from autd_trials.inbox import Inbox

CLOCK = RealClock()


def test_items_of_several_threads_arrive_once_each_in_each_ones_order() -> None:
    inbox: Inbox[tuple[int, int]] = Inbox(CLOCK)

    def put_all(thread_number: int) -> None:
        for i in range(1000):
            inbox.put([(thread_number, i)])

    threads = [threading.Thread(target=put_all, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    items: list[tuple[int, int]] = []
    while len(items) < 4000 and (new := inbox.take(CLOCK.now_s() + 5.0)):
        items += new
    for thread in threads:
        thread.join()
    for n in range(4):
        assert [i for thread_number, i in items if thread_number == n] == list(range(1000))


def test_endless_wait_is_possible_and_ends_with_an_item() -> None:
    inbox: Inbox[str] = Inbox(CLOCK)
    timer = threading.Timer(0.05, lambda: inbox.put(["here"]))
    timer.start()
    assert inbox.take(math.inf) == ["here"]
    timer.join()


def test_a_source_too_far_ahead_is_lost_with_what_found_no_room() -> None:
    inbox: Inbox[int] = Inbox(CLOCK, most=10)
    assert inbox.put(range(8))
    assert not inbox.put(range(8, 15))
    assert not inbox.put([99])
    assert inbox.take(math.inf) == list(range(10))
    with pytest.raises(DeviceError, match="more than 10 inputs wait to be read; the last 5 were dropped"):
        inbox.take(math.inf)


def test_loss_comes_after_the_items() -> None:
    inbox: Inbox[str] = Inbox(CLOCK)
    inbox.put(["last"])
    inbox.lose("it was lost", where="box", do="plug it in")
    assert inbox.take(math.inf) == ["last"]
    with pytest.raises(DeviceError, match="box: it was lost\n  -> plug it in"):
        inbox.take(math.inf)
