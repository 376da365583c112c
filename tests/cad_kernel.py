"""What makes the CAD kernel answer tests sooner: a process that has loaded it and forks, and answers that are kept.

The kernel takes 1 s of processor time to load, and each file that is read starts a process. Tests about this process
itself, in the folders :data:`OF_CAD`, start it as users do and ask it themselves.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

from chipload.geometry import isolated
from chipload.geometry.isolated import Isolated, pack_value, unpack_message

#: first parts of the paths below tests/ whose tests are about the process of the CAD kernel
OF_CAD = ("bad", "geometry", "test_cad_kernel.py", "test_extras.py", "test_workers.py")
#: how often it is asked whether a process has ended [s]
POLL_S = 0.01


class Forked:
    """A process of the kernel, with what :class:`Isolated` uses of ``subprocess.Popen``."""

    def __init__(self, loaded: Loaded) -> None:
        child_in, mine_out = os.pipe()
        mine_in, child_out = os.pipe()
        self.stdin: IO[bytes] = os.fdopen(mine_out, "wb")
        self.stdout: IO[bytes] = os.fdopen(mine_in, "rb")
        self.loaded = loaded
        self.code: int | None = None
        self.pid = int(loaded.asked({"fork": True}, child_in, child_out))
        for end in (child_in, child_out):
            os.close(end)

    def kill(self) -> None:
        if self.code is None:
            self.loaded.asked({"kill": self.pid})

    def wait(self, timeout: float) -> int:
        until = time.monotonic() + timeout
        while self.code is None:
            try:
                self.code = self.loaded.asked({"ended": self.pid})
            except OSError:  # the process that forked it has ended, and has ended it
                self.code = -signal.SIGKILL
            if self.code is None:
                if time.monotonic() > until:
                    raise subprocess.TimeoutExpired("kernel", timeout)
                time.sleep(POLL_S)
        return self.code


class Loaded:
    """The process that has loaded the kernel; it ends when this one does."""

    def __init__(self) -> None:
        mine, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        path = os.pathsep.join(p for p in sys.path if p)
        with other:
            self.process = subprocess.Popen(
                [sys.executable, "-P", __file__, str(other.fileno())], pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                start_new_session=True, env={**os.environ, **threads, "PYTHONPATH": path},
            )  # fmt: skip
        self.socket, self.lock = mine, threading.Lock()

    def close(self) -> None:
        """End it, and with it what it has forked."""
        self.socket.close()
        self.process.wait()

    def asked(self, what: dict[str, Any], *files: int) -> Any:
        with self.lock:
            socket.send_fds(self.socket, [json.dumps(what).encode()], files)
            return json.loads(self.socket.recv(4096))


class CadAnswers:
    """Answers of the kernel by what the file holds and what was asked; starts of its process, by forks."""

    def __init__(self) -> None:
        self.known: dict[bytes, bytes] = {}
        self.used = False
        self.ask, self.start = Isolated.call, isolated._start
        self.loaded: Loaded | None = None

    def call(self, of: Isolated, function: str, *values: Any) -> Any:
        """As :meth:`Isolated.call`; each answer is read from its message again, so that nothing is shared."""
        if not self.used:
            return self.ask(of, function, *values)
        asked = pack_value([of.reader, of.file.name, of.key, function, *values])
        key = hashlib.sha256(of.file.read_bytes() + asked).digest()
        if key not in self.known:
            self.known[key] = pack_value(self.ask(of, function, *values))
        return unpack_message(io.BytesIO(self.known[key]))

    def started(self) -> Any:
        """A process of the kernel."""
        if not self.used:
            return self.start()
        self.loaded = self.loaded or Loaded()
        return Forked(self.loaded)

    def close(self) -> None:
        """End the process that has loaded the kernel."""
        if self.loaded is not None:
            self.loaded.close()


def used() -> CadAnswers:
    """Let all tests of this process use them where they are asked to."""
    cad = CadAnswers()
    Isolated.call = lambda *words: cad.call(*words)  # type: ignore[method-assign]
    isolated._start = cad.started
    return cad


def is_about_cad(path: Path) -> bool:
    """Whether a file of tests is about the process of the kernel."""
    own = Path(__file__).parent
    return not path.is_relative_to(own) or path.relative_to(own).parts[0] in OF_CAD


def _serve(control: socket.socket) -> None:
    """Fork and watch processes of the kernel until the tests end."""
    if find_spec("OCP"):
        import_module("OCP.STEPControl")
    for module in isolated.SERVED:
        import_module(f"chipload.geometry.{module}")
    alive: set[int] = set()
    codes: dict[int, int] = {}
    while True:
        text, files, _, _ = socket.recv_fds(control, 4096, 2)
        if not text:
            break
        what = json.loads(text)
        answer: int | None = None
        if "fork" in what:
            answer = os.fork()
            if answer == 0:
                try:
                    control.close()
                    os.setsid()
                    for number, end in enumerate(files):
                        os.dup2(end, number)
                        os.close(end)
                    isolated._serve()
                finally:
                    os._exit(0)
            alive.add(answer)
            for end in files:
                os.close(end)
        for pid in list(alive):
            found, status = os.waitpid(pid, os.WNOHANG)
            if found:
                alive.discard(pid)
                codes[pid] = os.waitstatus_to_exitcode(status)
        if "kill" in what and what["kill"] in alive:
            os.kill(what["kill"], signal.SIGKILL)
        elif "ended" in what:
            answer = codes.get(what["ended"])
        control.send(json.dumps(answer).encode())
    for pid in alive:
        os.kill(pid, signal.SIGKILL)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
