"""Parameters of RS-274 text: numbered, named, and those that mirror the state of the controller.

Notation: a key is a number (``#31``) or a name in lower case without spaces (``#<depth>``; ``#<_depth>`` is global).
Numbers 1 to 30 and names without ``_`` belong to the subroutine that runs. What the program assigns in a block holds
from the next block on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from chipload.errors import InputError

#: numbers of LinuxCNC's parameters run from 1 to this
HIGHEST = 5601
#: parameters 1 to this are saved by a call
LOCAL = 30
#: a program may define as many names
MOST_NAMES = 10_000
_READ_ONLY = range(5400, 5429)

Noted = Callable[[str, str], None]


class Parameters:
    """Values by number and by name.

    Parameters
    ----------
    given : values that stand before the program starts, by number or name
    noted : called with (code, text) when a number is read that nobody has set
    highest : greatest number
    """

    def __init__(
        self, given: Mapping[int | str, float] | None = None, noted: Noted | None = None, highest: int = HIGHEST
    ):
        self.highest = highest
        self.numbered: dict[int, float] = {}
        self.shared: dict[str, float] = {}
        self.local: dict[str, float] = {}
        for key, value in (given or {}).items():
            if isinstance(key, str):
                (self.shared if key.startswith("_") else self.local)[key] = float(value)
                continue
            if not 1 <= key <= highest:
                raise InputError(f"parameter #{key}: the number must be from 1 to {highest}")
            self.numbered[int(key)] = float(value)
        #: read by a call, never assigned
        self.live: dict[int | str, Callable[[], float]] = {}
        self.noted = noted
        #: value of a number that is a row of a table (tool offsets), and where one is assigned; None: no such table
        self.row: Callable[[int], float | None] | None = None
        self.keep: Callable[[int, float], bool] | None = None
        self._stack: list[tuple[dict[int, float], dict[str, float]]] = []

    def read(self, key: int | str) -> float:
        """Value of a parameter; an unset number is 0, an unset name is refused."""
        if key in self.live:
            return self.live[key]()
        if isinstance(key, int):
            if not 1 <= key <= self.highest:
                raise InputError(f"parameter #{key}: the number must be from 1 to {self.highest}")
            if self.row is not None and (kept := self.row(key)) is not None:
                return kept
            value = self.numbered.get(key)
            if value is None:
                if self.noted is not None and (key < 5000 or key > HIGHEST):
                    message = f"#{key} is read before it is set and is taken as 0: state it in program.parameters"
                    self.noted("nc-parameter-unset", message)
                return 0.0
            return value
        space = self.shared if key.startswith("_") else self.local
        if key not in space:
            message = "is read before it is set: assign it first, or state it in program.parameters"
            raise InputError(f"parameter #<{key}>: {message}")
        return space[key]

    def exists(self, key: int | str) -> bool:
        """Whether a parameter can be read."""
        if isinstance(key, int) or key in self.live:
            return True
        return key in (self.shared if key.startswith("_") else self.local)

    def assign(self, key: int | str, value: float) -> None:
        """Set a parameter."""
        if isinstance(key, int):
            if not 1 <= key <= self.highest:
                raise InputError(f"parameter #{key}: the number must be from 1 to {self.highest}")
            if self.keep is not None and self.keep(key, value):
                return
            if key in _READ_ONLY:
                raise InputError(f"parameter #{key}: is the controller's own and cannot be assigned")
            self.numbered[key] = value
            return
        if key in self.live:
            raise InputError(f"parameter #<{key}>: is the controller's own and cannot be assigned")
        space = self.shared if key.startswith("_") else self.local
        if key not in space and len(self.shared) + len(self.local) >= MOST_NAMES:
            raise InputError(f"parameter #<{key}>: more than {MOST_NAMES} names")
        space[key] = value

    def declare(self, key: int | str) -> None:
        """A name that a block assigns is 0 for the rest of that block where it was not set before."""
        if isinstance(key, str) and not self.exists(key):
            self.assign(key, 0.0)

    def enter(self, arguments: list[float]) -> None:
        """Begin a subroutine: its own names and #1 to #30, the arguments first."""
        kept = {n: self.numbered[n] for n in range(1, LOCAL + 1) if n in self.numbered}
        self._stack.append((kept, self.local))
        for n in range(1, LOCAL + 1):
            self.numbered[n] = arguments[n - 1] if n <= len(arguments) else 0.0
        self.local = {}

    def leave(self) -> None:
        """End a subroutine: names and #1 to #30 as before."""
        kept, self.local = self._stack.pop()
        for n in range(1, LOCAL + 1):
            self.numbered.pop(n, None)
        self.numbered.update(kept)
