"""Threads: every piece once, errors reach the caller, cancelling drops what has not begun."""

import threading

import pytest

from renderer.core.errors import RenderCancelled
from renderer.core.workers import Workers, thread_count


@pytest.fixture
def workers():
    workers = Workers(3)
    yield workers
    workers.close()
    workers.close()


def test_every_piece_is_done_once(workers):
    done, numbers = [], set()

    def work(worker, piece):
        numbers.add(worker)
        done.append(piece)

    workers.run(work, range(1000))
    assert sorted(done) == list(range(1000))
    assert numbers <= {0, 1, 2}


def test_errors_reach_the_caller(workers):
    def work(worker, piece):
        if piece == 5:
            raise ZeroDivisionError("piece 5")

    with pytest.raises(ZeroDivisionError, match="piece 5"):
        workers.run(work, range(10))
    workers.run(lambda worker, piece: None, range(10))


def test_cancelling_finishes_what_has_begun_and_drops_the_rest(workers):
    begun, go = [], threading.Event()

    def work(worker, piece):
        begun.append(piece)
        go.wait(10)

    def cancelled():
        if len(begun) < 3:
            return False
        threading.Timer(0.05, go.set).start()
        return True

    with pytest.raises(RenderCancelled):
        workers.run(work, range(100), cancelled)
    assert sorted(begun) == [0, 1, 2]


def test_one_worker_is_the_calling_thread_before_and_after_a_context_that_asks_for_it():
    workers, seen = Workers(1), set()

    def note(worker, piece):
        seen.add((worker, threading.get_ident()))

    workers.run(note, range(3))
    with workers.in_this_thread():
        workers.run(note, range(3))
    workers.run(note, range(3))
    assert seen == {(0, threading.get_ident())}
    workers.close()


def test_many_workers_are_other_threads_but_within_a_context_that_asks_for_the_calling_one(workers):
    seen = set()
    workers.run(lambda worker, piece: seen.add(threading.get_ident()), range(9))
    assert threading.get_ident() not in seen
    seen.clear()
    with workers.in_this_thread():
        workers.run(lambda worker, piece: seen.add(threading.get_ident()), range(9))
    assert seen == {threading.get_ident()}
    seen.clear()
    workers.run(lambda worker, piece: seen.add(threading.get_ident()), range(9))
    assert threading.get_ident() not in seen


def test_threads_are_as_asked_or_all():
    assert thread_count(7) == 7
    assert thread_count(0) >= 1


def test_in_this_thread_every_piece_is_the_callers_own():
    workers, seen = Workers(3), []
    with workers.in_this_thread():
        workers.run(lambda worker, piece: seen.append((worker, piece, threading.current_thread())), range(4))
    assert seen == [(0, piece, threading.current_thread()) for piece in range(4)]
    with pytest.raises(RenderCancelled), workers.in_this_thread():
        workers.run(lambda worker, piece: seen.append(piece), [9], lambda: True)
    assert 9 not in seen
    workers.run(lambda worker, piece: seen.append(threading.current_thread()), [0])
    assert seen[-1] is not threading.current_thread()
    workers.close()
