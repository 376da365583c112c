"""Cache of the shapes that the browser fetches, by hash; the oldest are removed first."""

from __future__ import annotations

import hashlib
from collections import OrderedDict

#: bytes that are kept at most, the newest always
CAPACITY = 200_000_000


class AssetCache:
    """Documents of the 3D view by their hash."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, bytes] = OrderedDict()

    def put(self, data: bytes) -> str:
        """Keep a file; its address."""
        key = hashlib.sha256(data).hexdigest()
        self._kept[key] = data
        self._kept.move_to_end(key)
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > CAPACITY:
            self._kept.popitem(last=False)
        return f"/shape/{key}.bin"

    def get(self, key: str) -> bytes | None:
        """A file that was put here."""
        return self._kept.get(key)
