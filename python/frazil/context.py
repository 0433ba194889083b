"""Threads, cancel, progress, warnings."""

import ctypes as c

from ._library import ABI_VERSION, LOG, POLL, Handle, Progress, Span, StageTime, call, library, made


class Context(Handle):
    """One computation's side channel, on worker threads of its own or on those of another context.

    poll(stage, stages_done, seconds) is called on this thread some ten times a second at least; a true answer
    cancels. log(text) takes warnings. Neither may raise: Python prints such exceptions and goes on.
    """

    _destroy = "frz_context_destroy"

    def __init__(self, threads=0, poll=None, log=None, memory_limit=0):
        pool = made("pool_create", threads)
        try:
            super().__init__(made("context_create", ABI_VERSION, pool))
        finally:
            # The context keeps the threads.
            library.frz_pool_destroy(pool)
        self._callbacks = []
        if poll:
            self._callbacks.append(POLL(lambda _, progress: self._ask(poll, progress.contents)))
            call("context_set_poll", self.pointer, c.cast(self._callbacks[-1], c.c_void_p), None)
        if log:
            self._callbacks.append(LOG(lambda _, said: log(said.decode("utf-8", "replace"))))
            call("context_set_log", self.pointer, c.cast(self._callbacks[-1], c.c_void_p), None)
        if memory_limit:
            call("context_set_memory_limit", self.pointer, memory_limit)

    @staticmethod
    def _ask(poll, progress):
        return 1 if poll(progress.stage.decode(), progress.stages_done, progress.seconds) else 0

    def cancel(self):
        """Cancels the running call and later ones until reset(); from any thread."""
        library.frz_context_cancel(self.pointer)

    def reset(self):
        """Forgets a cancel."""
        library.frz_context_reset(self.pointer)

    def progress(self):
        """What is being done: (stage, stages done, seconds); from any thread."""
        out = Progress()
        call("context_progress", self.pointer, c.byref(out))
        return out.stage.decode(), out.stages_done, out.seconds

    def timings(self):
        """The stages of the last call: a list of (stage, seconds)."""
        count = c.c_size_t()
        call("context_timings", self.pointer, Span(None, 0, 0), c.byref(count))
        times = (StageTime * max(count.value, 1))()
        call("context_timings", self.pointer, Span(c.addressof(times), count.value, 0), c.byref(count))
        return [(time.stage.decode(), time.seconds) for time in times[: count.value]]
