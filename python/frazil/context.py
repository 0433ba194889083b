"""Threads, cancel, progress, warnings."""

import ctypes as c
import weakref

from ._library import ABI_VERSION, LOG, POLL, Handle, Progress, Span, StageTime, call, keep, library, made, stops


class Pool(Handle):
    """Worker threads that any number of contexts share. 0: the calling thread does all the work."""

    _destroy = "frz_pool_destroy"

    def __init__(self, threads=0):
        self.threads = threads
        super().__init__(made("pool_create", threads))

    def _words(self):
        return f"of {self.threads} threads"


class Context(Handle):
    """A computation: its cancel flag, progress, polls and warnings, on worker threads of its own or on those of a Pool.

    poll(stage, stages_done, seconds) is called on this thread at least about ten times per second; stage is the name of the
    running phase. A true return value cancels. log(text) receives warnings. An exception in either of them, or Ctrl-C, ends the
    running call, which changes nothing and raises this exception.
    """

    _destroy = "frz_context_destroy"

    def __init__(self, threads=0, poll=None, log=None, memory_limit=0, pool=None):
        if pool is not None and threads:
            raise ValueError("give either threads or a pool, not both")
        self._shares = pool is not None
        self.pool = pool if self._shares else Pool(threads)
        super().__init__(made("context_create", ABI_VERSION, self.pool.pointer))
        self._asked = False
        # If the context referred to itself, its threads would live until the garbage collector ran.
        me = weakref.ref(self)
        # Kept here as long as C may call them. There is always a poll, because Ctrl-C is detected in it.
        self._poll = POLL(lambda _, progress: me()._ask(poll, progress))
        call("context_set_poll", self.pointer, c.cast(self._poll, c.c_void_p), None)
        if log:
            self._log = LOG(lambda _, said: me()._tell(log, said))
            call("context_set_log", self.pointer, c.cast(self._log, c.c_void_p), None)
        if memory_limit:
            call("context_set_memory_limit", self.pointer, memory_limit)

    def close(self):
        """Destroys the context, and its threads if they are its own."""
        super().close()
        if not getattr(self, "_shares", True):
            self.pool.close()

    def _ask(self, poll, progress):
        try:
            now = progress.contents
            answer = poll is not None and poll(now.stage.decode(), now.stages_done, now.seconds)
            self._asked |= bool(answer)
        except BaseException as error:  # KeyboardInterrupt is not an Exception
            keep(error)
            answer = False
        return int(stops(self) or bool(answer))

    def _tell(self, log, said):
        try:
            log(said.decode("utf-8", "replace"))
        except BaseException as error:
            keep(error)
        if stops(self):
            library.frz_context_cancel(self.pointer)

    def go_on(self):
        """Clears the cancel of a call that an exception ended, unless a cancel was also requested."""
        if not self._asked:
            library.frz_context_reset(self.pointer)

    def cancel(self):
        """Cancels the running call and later ones until reset(); from any thread."""
        self._asked = True
        library.frz_context_cancel(self.pointer)

    def reset(self):
        """Clears a cancel, for the calls that follow."""
        self._asked = False
        library.frz_context_reset(self.pointer)

    def _words(self):
        return f"on {self.pool.threads} threads"

    def progress(self):
        """The progress: (name of the running phase, phases done, seconds since the running call began); from any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return out.stage.decode(), out.stages_done, out.seconds

    @property
    def fraction(self):
        """Completed fraction of the running phase, 0 to 1; None if unknown. May be read in a poll, or on any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return None if out.fraction < 0 else out.fraction

    def timings(self):
        """The phases of the last call: a list of (name, seconds)."""
        count = c.c_size_t()
        call("context_timings", self.pointer, Span(None, 0, 0), c.byref(count))
        times = (StageTime * max(count.value, 1))()
        call("context_timings", self.pointer, Span(c.addressof(times), count.value, 0), c.byref(count))
        return [(time.stage.decode(), time.seconds) for time in times[: count.value]]
