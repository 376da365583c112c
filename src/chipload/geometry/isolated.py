"""Reading of files by native code in a separate process with limits of time and memory.

On some damaged files the CAD kernel crashes or does not return. Therefore it runs in a child process: the same
interpreter, which reads one file and answers calls until it is closed. If the child ends early, the caller gets an
``InputError``.

Notation: a message is a JSON value followed by its arrays, ``length | JSON | length | npy | ...``; the JSON refers to
an array as ``{"array": number}``. Neither side executes what the other sends: only the parent names functions, these
must belong to :data:`SERVED`, and arrays contain numbers only.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import selectors
import signal
import struct
import subprocess
import sys
import time
import weakref
from pathlib import Path
from typing import IO, Any

import numpy as np

from chipload.errors import InputError
from chipload.lazy import require_extra
from chipload.processes import own_group

#: modules whose functions a child executes; their parameters are the shape and plain values
SERVED = ("brep", "step", "step_faces", "step_meridian", "step_patch", "step_roles", "step_side")
#: limit of processor time [s] for each call, and addition for each MB of the file
CALL_S, MB_S = 10.0, 10.0
#: limit of elapsed time over that of processor time, since the processor may be shared
PATIENCE = 8.0
#: limit of the address space of a child [bytes]
MEMORY = 4 << 30
#: largest message [bytes]
LARGEST = 1 << 30
_END = struct.Struct("<Q")


class Isolated:
    """A child process that reads one file, at the first call, and answers calls on it.

    Parameters
    ----------
    file : the file
    key : job key that names the file, for messages, such as ``part.file``
    reader : function that reads it, ``module.name`` with a module of :data:`SERVED`
    """

    def __init__(self, file: Path, key: str, reader: str) -> None:
        self.file, self.key, self.reader = file, key, reader
        self._process: subprocess.Popen[bytes] | None = None
        self._seconds = CALL_S + MB_S * 1e-6 * file.stat().st_size

    def __enter__(self) -> Isolated:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the child."""
        if self._process is not None:
            _kill(self._process)
            self._process = None

    def call(self, function: str, *values: Any) -> Any:
        """The result of a function, ``module.name``, on the file; ``values`` and the result are plain values or arrays.

        Raises
        ------
        InputError
            The function raised it, the CAD kernel is not installed, or the child ended, took too long or needed too
            much memory.
        """
        try:
            if self._process is None:
                require_extra("cad")
                self._process = _start()
                weakref.finalize(self, _kill, self._process)
                self._request(self._process, [self.reader, str(self.file), self.key])
            return self._request(self._process, [function, *values])
        except BaseException:
            self.close()
            raise

    def _request(self, process: subprocess.Popen[bytes], values: list[Any]) -> Any:
        pipe_in, pipe_out = process.stdin, process.stdout
        try:
            if pipe_in is None or pipe_out is None:
                raise EOFError
            pipe_in.write(pack_value([self._seconds, values]))
            pipe_in.flush()
            kind, answer = unpack_message(_Timed(pipe_out, time.monotonic() + PATIENCE * self._seconds))
        except (OSError, EOFError):
            raise InputError(f"{self.key} = {self.file.name}: {self._why(process)}") from None
        if kind == "refused":
            raise InputError(str(answer))
        if kind == "memory":
            raise InputError(f"{self.key} = {self.file.name}: {_TOO_LARGE}")
        if kind == "fault":
            raise InputError(f"{self.key} = {self.file.name}: damaged: the CAD kernel fails on it: {answer}")
        return answer

    def _why(self, process: subprocess.Popen[bytes]) -> str:
        """The reason why the child ended, for a message."""
        try:
            code = process.wait(0.5)
        except subprocess.TimeoutExpired:
            return self._slow()
        if code == -getattr(signal, "SIGXCPU", 0):
            return self._slow()
        if code == -getattr(signal, "SIGKILL", 0):
            return _TOO_LARGE
        return "damaged: the CAD kernel crashes on it: export it again from CAD, or repair it there"

    def _slow(self) -> str:
        return (
            f"the CAD kernel did not finish it within {self._seconds:.0f} s: export the part alone, or repair it in CAD"
        )


_TOO_LARGE = f"the CAD kernel needs more than {MEMORY >> 30} GiB for it: export the part alone, or raise chord_mm"


class _Timed:
    """Reader of a pipe with a deadline of the monotonic clock [s]."""

    def __init__(self, pipe: IO[bytes], until: float) -> None:
        self.pipe, self.until = pipe, until

    def read(self, count: int) -> bytes:
        """``count`` bytes.

        Raises
        ------
        TimeoutError
            They do not arrive before the deadline.
        EOFError
            The other side has closed the pipe.
        """
        out = bytearray()
        with selectors.DefaultSelector() as ready:
            ready.register(self.pipe, selectors.EVENT_READ)
            while len(out) < count:
                if not ready.select(self.until - time.monotonic()):
                    raise TimeoutError
                some = os.read(self.pipe.fileno(), min(count - len(out), 1 << 20))
                if not some:
                    raise EOFError
                out += some
        return bytes(out)


def pack_value(value: Any) -> bytes:
    """The message for a value: None, numbers, texts, arrays, and lists and mappings of them."""
    arrays: list[bytes] = []

    def plain(item: Any) -> Any:
        if isinstance(item, np.ndarray):
            out = io.BytesIO()
            np.save(out, np.ascontiguousarray(item), allow_pickle=False)
            arrays.append(out.getvalue())
            return {"array": len(arrays) - 1}
        if isinstance(item, np.generic):
            return item.item()
        if isinstance(item, dict):
            return {"mapping": [[plain(k), plain(v)] for k, v in item.items()]}
        return [plain(x) for x in item] if isinstance(item, (list, tuple)) else item

    text = json.dumps(plain(value)).encode()
    parts = [text, *arrays]
    return b"".join([_END.pack(len(parts)), *(_END.pack(len(p)) + p for p in parts)])


def unpack_message(source: Any) -> Any:
    """The value of the message that ``source.read(count)`` returns; tuples become lists.

    Raises
    ------
    EOFError
        The source ends within the message.
    OSError
        The message is larger than ``LARGEST``.

    >>> unpack_message(io.BytesIO(pack_value([1, (2.5, "a"), {"x": np.arange(2)}, None])))
    [1, [2.5, 'a'], {'x': array([0, 1])}, None]
    """

    def number() -> int:
        data = source.read(_END.size)
        if len(data) < _END.size:
            raise EOFError
        return int(_END.unpack(data)[0])

    parts, room = [], LARGEST
    for _ in range(number()):
        size = number()
        room -= size
        if room < 0:
            raise OSError("a message is too large")
        parts.append(source.read(size))
    arrays = [np.load(io.BytesIO(p), allow_pickle=False) for p in parts[1:]]

    def whole(item: Any) -> Any:
        if isinstance(item, dict):
            if "array" in item:
                return arrays[item["array"]]
            return {whole(k): whole(v) for k, v in item["mapping"]}
        return [whole(x) for x in item] if isinstance(item, list) else item

    return whole(json.loads(parts[0]))


def _start() -> subprocess.Popen[bytes]:
    """A child process in a separate session, so that Ctrl-C reaches only the parent."""
    words = [sys.executable, "-P", "-m", "chipload.geometry.isolated"]
    pipe = subprocess.PIPE
    # one thread for linear algebra: a pool would use up the limited address space
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        return subprocess.Popen(
            words, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, **own_group(),
            env={**os.environ, **threads, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )  # fmt: skip
    except OSError as err:
        raise InputError(f"no process can be started to read the file: {err.strerror}: free memory") from None


def _kill(process: subprocess.Popen[bytes]) -> None:
    with contextlib.suppress(OSError):
        process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(5.0)


def _limit() -> None:
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # macOS has the constant, and refuses the limit
        refused = (ValueError, OSError) if sys.platform == "darwin" else ()
        with contextlib.suppress(*refused):
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def _allow(seconds: float) -> None:
    """Raise the limit of processor time to ``seconds`` from now."""
    if sys.platform != "win32":
        import resource

        used = resource.getrusage(resource.RUSAGE_SELF)
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime + seconds) + 1, hard))


def _function(name: Any) -> Any:
    module, _, function = str(name).partition(".")
    if module not in SERVED:
        raise ValueError(f"{name}: is not served")
    return getattr(importlib.import_module(f"chipload.geometry.{module}"), function)


def _serve() -> None:
    """Answer the parent until it closes the pipe.

    The first call reads the file; its result is the first argument of all later calls. Output of the kernel is
    discarded, because standard output is the pipe to the parent.
    """
    source, target = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _limit()
    read: list[Any] = []
    while True:
        try:
            seconds, (name, *values) = unpack_message(source)
        except EOFError:
            return
        _allow(float(seconds))
        try:
            answer = _function(name)(*read, *values)
            if not read:
                read, answer = [answer], None
            data = pack_value(["done", answer])
        except InputError as err:
            data = pack_value(["refused", str(err)])
        except MemoryError:
            data = pack_value(["memory", None])
        except Exception as err:
            data = pack_value(["fault", " ".join(f"{type(err).__name__} {err}".split())[:120]])
        target.write(data)
        target.flush()


if __name__ == "__main__":
    _serve()
