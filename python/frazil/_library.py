"""The C library: finding it, calling it, its errors."""

from __future__ import annotations

import contextlib
import ctypes as c
import os
import pathlib
import signal
import threading
from typing import TYPE_CHECKING, Any, ClassVar, Iterator, Sequence, TypeVar, Union, cast

import numpy as np

from ._structs import Progress, Span, View

if TYPE_CHECKING:
    # NumPy has it since 1.20, typing_extensions need not be installed: only type checkers import them.
    import numpy.typing as npt
    from typing_extensions import Self

    from .context import Context

_Number = TypeVar("_Number", bound=np.generic)
# The path of a file or folder.
AnyPath = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]"]
# A few numbers, for instance a position: a tuple, a list or an array.
Numbers = Union[Sequence[float], "npt.NDArray[Any]"]

ABI_VERSION = 0x10009

OK, CANCELLED = 0, 5


POLL = c.CFUNCTYPE(c.c_int, c.c_void_p, c.POINTER(Progress))
LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p)

_P, _Z, _U, _D, _F, _S = c.c_void_p, c.c_size_t, c.c_uint32, c.c_double, c.c_float, c.c_char_p
_FUNCTIONS: dict[str, list[Any]] = {
    "pool_create": [_U, _P], "context_create": [_U, _P, _P], "context_set_poll": [_P, _P, _P],
    "context_set_log": [_P, _P, _P], "context_set_memory_limit": [_P, c.c_uint64],
    "context_progress": [_P, _P], "context_timings": [_P, Span, _P], "mesh_create": [_P, _P, _P],
    "mesh_get_info": [_P, _P], "mesh_read": [_P, _U, Span], "mesh_attribute": [_P, _S, Span, _P],
    "mesh_repair": [_P, _P, _D, _P, _P],
    "grid_create": [_P, _P, _P], "grid_copy": [_P, _P, _P], "grid_get_info": [_P, _P],
    "grid_name": [_P, _P, _Z, _P], "grid_set_name": [_P, _S], "grid_leaves": [_P, Span, _P],
    "grid_vector_leaves": [_P, Span, _P], "grid_vector_probe": [_P, View, Span],
    "grid_sample_vectors": [_P, _P, View, _U, Span], "grid_probe": [_P, View, Span], "grid_sample": [_P, _P, View, _U, Span],
    "grid_sample_mesh": [_P, _P, _P, _U, _S], "grid_to_mesh": [_P, _P, _F, _F, _P],
    "geometry_load": [_P, _S, _P], "geometry_count": [_P, _P], "geometry_get_part": [_P, _Z, _P],
    "geometry_get_array": [_P, _Z, _Z, _P], "grid_list": [_P, _S, Span, _P], "grid_load": [_P, _S, _S, _P], "grid_save": [_P, _P, _Z, _S, _U, _U],
    "grid_from_bytes": [_P, _P, _Z, _S, _P], "grid_to_bytes": [_P, _P, _Z, _U, _U, _P, _Z, _P],
    "levelset_from_mesh": [_P, _P, _D, _F, _P], "levelset_from_particles": [_P, View, View, _D, _F, _P],
    "levelset_csg": [_P, _U, _P, _P], "levelset_offset": [_P, _P, _F, _U],
    "levelset_smooth": [_P, _P, _U, _U, _U, _U], "levelset_displace": [_P, _P, _P],
    "levelset_sweep": [_P, _P, _Z, _D, _D, _F, _P], "snow_desc_init": [_P, _Z], "snow_layer": [_P, _P, _P],
    "base_params_init": [_P, _Z], "base_create": [_P, _P, _P, _P, _Z, _P], "base_set_params": [_P, _P],
    "base_step": [_P, _P, _P, _Z, _D, c.c_int32, _P], "base_save": [_P, _P, _P, _Z, _P],
    "base_dirty": [_P, _P, _P], "base_bounds": [_P, _P, _P], "grid_to_mesh_box": [_P, _P, _F, _F, _P, _P, _P],
    "grid_to_mesh_blocks": [_P, _P, _F, _F, View, _P],
    "grains_params_init": [_P, _Z], "grains_create": [_P, _P, _P, _Z, _P], "grains_set_params": [_P, _P],
    "grains_step": [_P, _P, _P, _P, _Z, _D, c.c_int32, _P],
    "grains_step_grids": [_P, _P, _P, _P, _P, _Z, _D, c.c_int32, _P],
    "grains_emit": [_P, _P, View, View, c.c_int32, _P], "grains_count": [_P, _P], "grains_read": [_P, _U, Span],
    "grains_save": [_P, _P, _P, _Z, _P],
    "mist_params_init": [_P, _Z], "mist_create": [_P, _P, _P, _Z, _P], "mist_set_params": [_P, _P],
    "mist_step": [_P, _P, _P, _P, _P, _P, _Z, _D, _D, _P],
    "mist_step_points": [_P, _P, View, View, _D, _P, _P, _P, _Z, _D, _D, _P],
    "mist_step_paths": [_P, _P, View, View, View, View, _D, _P, _P, _P, _Z, _D, _D, _P],
    "mist_grid": [_P, _P, _U, _P], "mist_save": [_P, _P, _P, _Z, _P],
    "particles_spacing": [_P, _P, _P], "tracker_params_init": [_P, _Z],
    "tracker_create": [_P, _P, _P, _P, _P, _Z, _P], "tracker_set_params": [_P, _P],
    "tracker_step": [_P, _P, _P, _P, _D, _P], "tracker_count": [_P, _P], "tracker_read": [_P, _U, Span],
    "tracker_triangle_count": [_P, _P], "tracker_read_triangles": [_P, Span], "tracker_edits": [_P, _P, _P],
    "tracker_read_edits": [_P, _U, Span], "tracker_resculpt": [_P, _P, _P, _P],
    "tracker_read_rest": [_P, _P, _P, _P, Span],
    "tracker_read_eased": [_P, _P, _P, _P, _Z, _U, _D, Span],
    "tracker_save": [_P, _P, _P, _Z, _P],
    "shallow_params_init": [_P, _Z], "shallow_params_liquid": [_P, _U], "shallow_create": [_P, _P, _P, _P, _P],
    "shallow_create_heights": [_P, _P, _P, View, _P], "shallow_create_grid": [_P, _P, _P, _P, _P],
    "shallow_set_params": [_P, _P], "shallow_step": [_P, _P, _D, _D, _P], "shallow_replay": [_P, _P, View, _P],
    "shallow_last_steps": [_P, Span, _P], "shallow_set_flows": [_P, _P, _Z], "shallow_flow_moved": [_P, _Z, _P],
    "shallow_pour": [_P, _P, _D, _D, _P], "shallow_fill": [_P, _D], "shallow_set_depths": [_P, View],
    "shallow_get_balance": [_P, _P], "shallow_update_terrain": [_P, _P, View, _P, _P],
    "shallow_update_heights": [_P, _P, View, _P, _P], "shallow_set_bodies": [_P, _P, _P, _Z, _P],
    "shallow_get_info": [_P, _P], "shallow_read": [_P, _U, View, Span], "shallow_lend": [_P, _U, _P],
    "shallow_probe": [_P, View, Span], "shallow_volume": [_P, _P, _P, _U, _P], "shallow_save": [_P, _P, _P, _Z, _P],
    "shallow_restore": [_P, _P, _P, _Z], "shallow_layout_init": [_P, _Z], "shallow_surface_bound": [_P, _P],
    "shallow_surface": [_P, _P, _P, _P, _P], "shallow_snapshot_create": [_P, _P, _P],
    "shallow_snapshot_take": [_P, _P], "shallow_snapshot_surface": [_P, _P, _P, _P, _P],
    "shallow_snapshot_probe": [_P, View, Span], "shallow_find_lifts": [_P, _P, _P, _P, _P],
    "shallow_find_ledges": [_P, _P, _P],
    "shallow_set_scalars": [_P, _P, _Z], "shallow_set_poured": [_P, View], "shallow_set_sourced": [_P, _Z, View],
    "shallow_read_scalar": [_P, _U, View, Span], "shallow_get_scalar_balance": [_P, _U, _P],
    "shallow_drops": [_P, Span, _P], "shallow_drops_mesh": [_P, _P, _P, _P, _P],
    "shallow_loads": [_P, _D, View, _P, _Z], "shallow_staining_init": [_P, _Z],
    "shallow_stains_create": [_P, _P, View, View, _P, _P], "shallow_stains_update": [_P, _P, _P, View, _P],
    "shallow_stains_read": [_P, Span], "shallow_stains_soaked": [_P, Span], "shallow_stains_absorbed": [_P, _P],
    "shallow_stains_save": [_P, _P, _P, _Z, _P], "shallow_stains_restore": [_P, _P, _P, _Z],
    "shallow_detail_create": [_P, _P, _P, _P, _P, _P], "shallow_detail_create_heights": [_P, _P, _P, View, _P, _P],
    "shallow_detail_set_params": [_P, _P], "shallow_detail_set_near": [_P, _P], "shallow_detail_get_near": [_P, _P],
    "shallow_detail_step": [_P, _P, _D, _P], "shallow_detail_set_flows": [_P, _P, _Z],
    "shallow_detail_set_rate": [_P, _Z, _D], "shallow_detail_flow_moved": [_P, _Z, _P],
    "shallow_detail_pour": [_P, _P, _D, _D, _P], "shallow_detail_fill": [_P, _D],
    "shallow_detail_get_balance": [_P, _P], "shallow_detail_update_terrain": [_P, _P, View, _P],
    "shallow_detail_update_heights": [_P, _P, View, _P], "shallow_detail_set_bodies": [_P, _P, _P, _Z, _P],
    "shallow_detail_surface_bound": [_P, _P], "shallow_detail_surface": [_P, _P, _P, _P, _P],
    "shallow_detail_set_scalars": [_P, _P, _Z], "shallow_detail_set_poured": [_P, View],
    "shallow_detail_set_sourced": [_P, _Z, View], "shallow_detail_get_scalar_balance": [_P, _U, _P],
    "shallow_detail_save": [_P, _P, _P, _Z, _P], "shallow_detail_restore": [_P, _P, _P, _Z],
    "shallow_snapshot_drops": [_P, Span, _P], "shallow_snapshot_drops_mesh": [_P, _P, _P, _P, _P],
}
_VOID = ["pool_destroy", "context_destroy", "context_cancel", "context_reset", "mesh_destroy", "grid_destroy",
         "base_destroy", "grains_destroy", "mist_destroy", "tracker_destroy", "shallow_destroy",
         "geometry_destroy", "shallow_snapshot_destroy", "shallow_stains_destroy", "shallow_detail_destroy"]
_LENT = ["base_grid", "base_removed", "base_compression", "base_touched"]


def saved(function: str, ctx: Context, pointer: int) -> bytes:
    """The bytes that a saving function of the C interface writes."""
    size = c.c_size_t()
    call(function, ctx.pointer, pointer, None, 0, c.byref(size))
    out = c.create_string_buffer(size.value)
    call(function, ctx.pointer, pointer, out, size.value, c.byref(size))
    return out.raw[: size.value]


class Error(Exception):
    """A call failed: one sentence that names what is at fault.

    status: the C interface's number: 1 an argument, 2 the contents of a file, 3 reading or writing, 4 memory, 5 cancelled, 6 OpenVDB, 7 a bug in
        frazil, 8 a handle that is unusable since one, 9 a handle that is in use by another call, 10 too small a buffer, 11 another version of the
        library, 12 a handle of another kind"""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status

    @property
    def cancelled(self) -> bool:
        """Whether the call was cancelled: everything is as it was before."""
        return self.status == CANCELLED


LIBRARY = "libfrazil.so.1"


def _find() -> str:
    """The path of the library: that in FRAZIL_LIBRARY, else next to this module, else in the installed tree, else just its
    name, which the system's loader looks up."""
    named = os.environ.get("FRAZIL_LIBRARY")
    if named:
        return named
    here = pathlib.Path(__file__).resolve()
    # The second: PREFIX/share/frazil/python/frazil/_library.py and PREFIX/lib/libfrazil.so.1
    near = [folder / LIBRARY for folder in (here.parent, *(top / "lib" for top in list(here.parents)[4:5]))]
    return next((str(path) for path in near if path.exists()), LIBRARY)


def _load() -> c.CDLL:
    path = _find()
    try:
        lib = c.CDLL(path)
    except OSError as error:
        raise ImportError(f"frazil's C library was not found ({error}): set FRAZIL_LIBRARY to the path of {LIBRARY}, or "
                          f"put it next to {pathlib.Path(__file__).parent}") from None
    lib.frz_version.restype = c.c_uint32
    lib.frz_last_error.restype = c.c_char_p
    kinds: dict[str, tuple[list[Any], Any]] = {name: (arguments, c.c_uint32) for name, arguments in _FUNCTIONS.items()}
    kinds |= {name: ([_P], None) for name in _VOID} | {name: ([_P], _P) for name in _LENT}
    for name, (arguments, answer) in kinds.items():
        # The core library lacks what needs OpenVDB.
        function = getattr(lib, "frz_" + name, None)
        if function is not None:
            function.argtypes, function.restype = arguments, answer
    return lib


library: c.CDLL = _load()


def version() -> tuple[int, int, int]:
    """The library's version, for instance (0, 2, 0)."""
    number = library.frz_version()
    return number // 1000000, number // 1000 % 1000, number % 1000


class _Calls(threading.local):
    """The exception that a callback raised in this thread's running call: it is raised again when the call has ended,
    because exceptions must not pass through C."""

    raised: BaseException | None = None
    # The contexts that were cancelled because of the exception.
    stopped: tuple[Context, ...] = ()


_calls = _Calls()


def keep(error: BaseException) -> None:
    """Keeps the first exception that callbacks raise in a call, which should then be cancelled."""
    if _calls.raised is None:
        _calls.raised = error


def stops(context: Context) -> bool:
    """Whether a callback raised an exception in this call, so that its context must be cancelled."""
    if _calls.raised is None:
        return False
    _calls.stopped = (*_calls.stopped, context)
    return True


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """Keeps what a handler of Ctrl-C raises during a call into C: Python runs the handler in the next callback, and would
    lose an exception raised before the callback's first line."""
    before = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if not callable(before):
        yield
        return

    def handler(number: int, frame: Any) -> None:
        try:
            before(number, frame)
        except BaseException as error:  # KeyboardInterrupt is not an Exception
            keep(error)

    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def call(name: str, *arguments: Any) -> None:
    """Calls frz_<name>; raises what a callback raised during the call, or Error if the call fails."""
    function = getattr(library, "frz_" + name, None)
    if function is None:
        raise NotImplementedError(f"the library has no frz_{name}: it is the core library, without OpenVDB, or an older one")
    outer = _calls.raised, _calls.stopped
    _calls.raised, _calls.stopped = None, ()
    try:
        with _interruptible():
            status = function(*arguments)
            said = library.frz_last_error() if status != OK else b""
        raised, stopped = _calls.raised, _calls.stopped
    finally:
        _calls.raised, _calls.stopped = outer
    if raised is not None:
        for context in stopped:
            context.go_on()
        raise raised
    if status != OK:
        raise Error(status, said.decode("utf-8", "replace"))


def _kind_of(name: str) -> str:
    """The kind of object that a function creates."""
    if name.startswith(("grid_to_mesh", "mesh_")):
        return "mesh"
    if name == "geometry_load":
        return "geometry"
    kind, create, _ = name.rpartition("_create")
    return kind if create else "grid"


def made(name: str, *arguments: Any, behind: Sequence[Any] = ()) -> int:
    """Calls frz_<name> with an out-pointer, which is the last argument except for those in `behind`. Returns the new handle."""
    out = c.c_void_p()
    try:
        call(name, *arguments, c.byref(out), *behind)
    except BaseException:
        # A callback raised an exception at the end of a call that succeeded.
        if out.value:
            getattr(library, f"frz_{_kind_of(name)}_destroy")(out.value)
        raise
    return cast(int, out.value)


def rows(array: npt.ArrayLike, kind: type[_Number], width: int) -> npt.NDArray[_Number]:
    """An array (n, width), C-contiguous; ValueError for another shape."""
    out = np.ascontiguousarray(array, dtype=kind)
    if out.ndim != 2 or out.shape[1] != width:
        raise ValueError(f"an array of shape (n, {width}) is needed, not {out.shape}")
    return out


def view(array: npt.NDArray[Any]) -> View:
    """A view of an array's rows; the array must outlive it."""
    return View(array.ctypes.data if len(array) else None, len(array), 0)


def span(array: npt.NDArray[Any]) -> Span:
    """Room for an array's rows; the array must outlive it."""
    return Span(array.ctypes.data if len(array) else None, len(array), 0)


def text(value: AnyPath | None) -> bytes | None:
    """A text for C; None stays None."""
    return None if value is None else os.fsencode(value)


class Handle:
    """Wraps a C handle, which is destroyed by close(), at the end of a with block, or with its last reference."""

    _destroy: ClassVar[str]

    def __init__(self, pointer: int, owner: Handle | None = None) -> None:
        self._pointer: int | None = pointer
        # A lent object keeps its owner alive, and is closed with it.
        self._owner = owner

    @property
    def pointer(self) -> int:
        """The C handle's address, for calls through frazil.library. Raises ValueError if it is closed."""
        if self.closed:
            raise ValueError(f"the {type(self).__name__} is closed")
        return cast(int, self._pointer)

    @property
    def closed(self) -> bool:
        """Whether close() was called, here or on the owner."""
        owner = getattr(self, "_owner", None)
        return not getattr(self, "_pointer", None) or (owner is not None and owner.closed)

    def close(self) -> None:
        """Frees the memory now; closing twice is harmless. Must not be called within a call that uses the handle."""
        pointer, self._pointer = getattr(self, "_pointer", None), None
        if pointer and getattr(self, "_owner", None) is None and library is not None:
            getattr(library, self._destroy)(pointer)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def __repr__(self) -> str:
        try:
            words = "closed" if self.closed else self._words()
        except Error as error:
            words = str(error)
        return f"<frazil.{type(self).__name__} {words}>"

    def _words(self) -> str:
        """A description for repr()."""
        raise NotImplementedError
