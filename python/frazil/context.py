"""Threads, cancel, progress, warnings."""

from __future__ import annotations

import ctypes as c
import weakref
from typing import Any, Callable, cast

from ._library import ABI_VERSION, LOG, POLL, Handle, call, keep, library, made, stops
from ._structs import Progress, Span, StageTime


class Pool(Handle):
    """Worker threads that any number of contexts share.

    threads: how many, 0 to 1024; 0: the calling thread does all the work."""

    _destroy = "frz_pool_destroy"

    def __init__(self, threads: int = 0) -> None:
        self.threads = threads
        super().__init__(made("pool_create", threads))

    def _words(self) -> str:
        return f"of {self.threads} threads"


class Context(Handle):
    """A computation: its cancel flag, progress, polls and warnings, on worker threads of its own or on those of a Pool.

    threads: number of worker threads of its own, 0 to 1024; 0: the calling thread does all the work. With a pool, ValueError.
    poll: called as poll(stage, stages_done, seconds) on the calling thread, at least about ten times per second (without worker threads:
        between pieces of work): the name of the running phase, the number of phases done, and the time since the call began (s). A true
        return value cancels.
    log: called as log(text) with each warning, one sentence, on the calling thread.
    memory_limit: bytes; a call that would need more fails. 0: the machine's memory.
    pool: a frazil.Pool, whose threads it uses.

    A call that is cancelled raises frazil.Error, with its `cancelled` True. An exception in poll or log, or Ctrl-C, ends the running call,
    which raises this exception. Both change nothing.
    """

    _destroy = "frz_context_destroy"

    def __init__(self, threads: int = 0, poll: Callable[[str, int, float], object] | None = None, log: Callable[[str], object] | None = None,
                 memory_limit: int = 0, pool: Pool | None = None) -> None:
        if pool is not None and threads:
            raise ValueError("give either threads or a pool, not both")
        self._shares = pool is not None
        self.pool: Pool = Pool(threads) if pool is None else pool
        super().__init__(made("context_create", ABI_VERSION, self.pool.pointer))
        self._asked = False
        # If the context referred to itself, its threads would live until the garbage collector ran.
        me = cast("Callable[[], Any]", weakref.ref(self))
        # Kept here as long as C may call them. There is always a poll, because Ctrl-C is detected in it.
        self._poll = POLL(lambda _, progress: me()._ask(poll, progress))
        call("context_set_poll", self.pointer, c.cast(self._poll, c.c_void_p), None)
        if log:
            self._log = LOG(lambda _, said: me()._tell(log, said))
            call("context_set_log", self.pointer, c.cast(self._log, c.c_void_p), None)
        if memory_limit:
            call("context_set_memory_limit", self.pointer, memory_limit)

    def close(self) -> None:
        """Destroys the context, and its threads if they are its own."""
        super().close()
        if not getattr(self, "_shares", True):
            self.pool.close()

    def _ask(self, poll: Callable[[str, int, float], object] | None, progress: Any) -> int:
        try:
            now = progress.contents
            answer: object = poll is not None and poll(now.stage.decode(), now.stages_done, now.seconds)
            self._asked |= bool(answer)
        except BaseException as error:  # KeyboardInterrupt is not an Exception
            keep(error)
            answer = False
        return int(stops(self) or bool(answer))

    def _tell(self, log: Callable[[str], object], said: bytes) -> None:
        try:
            log(said.decode("utf-8", "replace"))
        except BaseException as error:
            keep(error)
        if stops(self):
            library.frz_context_cancel(self.pointer)

    def go_on(self) -> None:
        """Clears the cancel of a call that an exception ended, unless a cancel was also requested."""
        if not self._asked:
            library.frz_context_reset(self.pointer)

    def cancel(self) -> None:
        """Cancels the running call and later ones until reset(): they raise frazil.Error. From any thread."""
        self._asked = True
        library.frz_context_cancel(self.pointer)

    def reset(self) -> None:
        """Clears a cancel, for the calls that follow; a running call stays cancelled. From any thread."""
        self._asked = False
        library.frz_context_reset(self.pointer)

    def _words(self) -> str:
        return f"on {self.pool.threads} threads"

    def progress(self) -> tuple[str, int, float]:
        """The progress: the name of the running phase, "" between phases; the number of phases done; the time since the running call began (s),
        0 between calls. From any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return out.stage.decode(), out.stages_done, out.seconds

    @property
    def fraction(self) -> float | None:
        """Completed fraction of the running phase, 0 to 1; None if unknown. May be read in a poll, or on any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return None if out.fraction < 0 else out.fraction

    def timings(self) -> list[tuple[str, float]]:
        """The phases of the last call that had any, in the order of their first runs: the name of each, and its time (s), the sum of its runs."""
        count = c.c_size_t()
        call("context_timings", self.pointer, Span(None, 0, 0), c.byref(count))
        times = (StageTime * max(count.value, 1))()
        call("context_timings", self.pointer, Span(c.addressof(times), count.value, 0), c.byref(count))
        return [(time.stage.decode(), time.seconds) for time in times[: count.value]]
