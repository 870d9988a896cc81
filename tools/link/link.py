# SPDX-License-Identifier: MIT
"""A thread that keeps a board: streams from it, asks it, and finds it again when it was away."""

import queue
import threading
import time
from concurrent.futures import Future

from tools.link.board import Board, BoardError
from tools.link.reader import Reader

KEEP_S = 3  # what the board is told, and three times as often as that it is told anew
AGAIN_S = 0.5


class Away(Exception):
    """There is no board at the moment."""


class Link:
    """One board at `port`. on_batch(batch) and on_state(text) are called in its thread.

    channels: names, or None for the board's default. state: "" while all is well, else why not;
    away: how often the board went.
    """

    def __init__(self, port, on_batch, channels=None, every=1, on_state=None):
        self.reader = Reader()
        self.port = port
        self.state = "connecting"
        self.away = 0
        self._start = _start(channels, every)
        self._on_batch, self._on_state = on_batch, on_state or (lambda state: None)
        self._asked = queue.SimpleQueue()
        self._board = None
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._live, name="link", daemon=True)

    def start(self):
        """Begin; returns itself."""
        self._thread.start()
        return self

    def stop(self):
        """Leave the board; it stops to stream."""
        self._ends.set()
        self._thread.join(10)

    @property
    def received(self):
        """Bytes of this connection, and its damaged frames."""
        line = self._board.line if self._board else None
        return (line.received, line.bad) if line else (0, 0)

    def ask(self, code):
        """A Future of what these lines print on the board: BoardError, Away."""
        answer = Future()
        if self.state:
            answer.set_exception(Away(self.state))
        else:
            self._asked.put((code, answer))
        return answer

    def call(self, code, timeout_s=15):
        """The same, waited for."""
        return self.ask(code).result(timeout_s)

    def set(self, name, value):
        """A Future of a knob's change."""
        return self.ask(f"app.set({name!r}, {value!r})")

    def stream(self, channels=None, every=1):
        """A Future of a stream with other channels."""
        self._start = _start(channels, every)
        return self.ask(self._start)

    def _live(self):
        while not self._ends.is_set():
            try:
                self._board = Board(self.port)
                self._board.run(self._start)
                self.reader.begin()
                self._say("")
                self._serve()
            except BoardError as error:
                self._say(f"the board says: {error}")
            except OSError as error:
                self._say(f"no board: {error}")
            finally:
                if self._board is not None:
                    self._board.close()
                self._board = None
                self._refuse()
            self._ends.wait(AGAIN_S)

    def _serve(self):
        board = self._board
        kept = time.monotonic()
        while not self._ends.is_set():
            self.reader.feed(board.contents())
            for batch in self.reader.take():
                self._on_batch(batch)
            self._answer(board)
            if time.monotonic() - kept > KEEP_S / 3:
                board.run(f"app.stream.on or {self._start}\napp.stream.keep({KEEP_S})")
                kept = time.monotonic()
        board.run("app.stream.stop()")

    def _answer(self, board):
        try:
            code, answer = self._asked.get_nowait()
        except queue.Empty:
            return
        try:
            answer.set_result(board.run(code))
        except BoardError as error:
            answer.set_exception(error)
        except BaseException as error:
            answer.set_exception(Away(str(error)))
            raise

    def _refuse(self):
        while not self._asked.empty():
            self._asked.get()[1].set_exception(Away(self.state))

    def _say(self, state):
        if state and not self.state:
            self.away += 1
        if state != self.state:
            self.state = state
            self._on_state(state)


def _start(channels, every):
    named = "" if channels is None else f"{tuple(channels)!r}, "
    return f"app.stream.start({named}every={every}, keep_s={KEEP_S})"
