"""Threads, cancel, progress, warnings."""

import ctypes as c
import weakref

from ._library import ABI_VERSION, LOG, POLL, Handle, Progress, Span, StageTime, call, keep, library, made, stops


class Pool(Handle):
    """Worker threads that any number of contexts share. 0: all work is done by the thread that calls."""

    _destroy = "frz_pool_destroy"

    def __init__(self, threads=0):
        self.threads = threads
        super().__init__(made("pool_create", threads))

    def _words(self):
        return f"of {self.threads} threads"


class Context(Handle):
    """One computation's side channel, on worker threads of its own or on those of a Pool.

    poll(stage, stages_done, seconds) (stage: the verb of the running phase) is called on this thread some ten times a second at least; a true answer
    cancels. log(text) takes warnings. What either of them raises, and Ctrl-C, ends the running call, which changes
    nothing, and is raised by it.
    """

    _destroy = "frz_context_destroy"

    def __init__(self, threads=0, poll=None, log=None, memory_limit=0, pool=None):
        if pool is not None and threads:
            raise ValueError("threads are the pool's: give one of the two")
        self._shares = pool is not None
        self.pool = pool if self._shares else Pool(threads)
        super().__init__(made("context_create", ABI_VERSION, self.pool.pointer))
        self._asked = False
        # A reference from here to itself would keep its threads until the garbage collector comes.
        me = weakref.ref(self)
        # Kept here as long as C may call them. There is always a poll: Ctrl-C is heard in it.
        self._poll = POLL(lambda _, progress: me()._ask(poll, progress))
        call("context_set_poll", self.pointer, c.cast(self._poll, c.c_void_p), None)
        if log:
            self._log = LOG(lambda _, said: me()._tell(log, said))
            call("context_set_log", self.pointer, c.cast(self._log, c.c_void_p), None)
        if memory_limit:
            call("context_set_memory_limit", self.pointer, memory_limit)

    def close(self):
        """Gives the context back, and its threads if they are its own."""
        super().close()
        if not getattr(self, "_shares", True):
            self.pool.close()

    def _ask(self, poll, progress):
        try:
            now = progress.contents
            answer = poll is not None and poll(now.stage.decode(), now.stages_done, now.seconds)
            self._asked |= bool(answer)
        except BaseException as error:  # KeyboardInterrupt is none of Exception
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
        """Forgets the cancel of a call that an exception ended, unless somebody asked for one besides."""
        if not self._asked:
            library.frz_context_reset(self.pointer)

    def cancel(self):
        """Cancels the running call and later ones until reset(); from any thread."""
        self._asked = True
        library.frz_context_cancel(self.pointer)

    def reset(self):
        """Forgets a cancel, for the calls that follow."""
        self._asked = False
        library.frz_context_reset(self.pointer)

    def _words(self):
        return f"on {self.pool.threads} threads"

    def progress(self):
        """What is being done: (verb of the running phase, phases done, seconds); from any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return out.stage.decode(), out.stages_done, out.seconds

    @property
    def fraction(self):
        """Fraction of the running phase that is done, 0 to 1; None where that is not known. For a poll, or any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return None if out.fraction < 0 else out.fraction

    def timings(self):
        """The phases of the last call: a list of (verb, seconds)."""
        count = c.c_size_t()
        call("context_timings", self.pointer, Span(None, 0, 0), c.byref(count))
        times = (StageTime * max(count.value, 1))()
        call("context_timings", self.pointer, Span(c.addressof(times), count.value, 0), c.byref(count))
        return [(time.stage.decode(), time.seconds) for time in times[: count.value]]
