"""Arrays whose references compiled loops do not count.

Counting the references of every row that a loop looks at took more than half of the time of the moves: atomic
additions, two a row. An array that is borrowed is not counted; the caller owns it and keeps it until the loop ends.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


@intrinsic
def borrow_arrays(typing: Any, array: Any) -> Any:
    """The array itself, or a tuple of arrays, without an owner."""

    def loose(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        out = context.make_array(kind)(context, builder, value)
        out.meminfo = cgutils.get_null_value(out.meminfo.type)
        return out._getvalue()

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = signature.args[0]
        if isinstance(kind, types.Array):
            return loose(context, builder, kind, args[0])
        each = cgutils.unpack_tuple(builder, args[0])
        return context.make_tuple(
            builder, kind, [loose(context, builder, k, v) for k, v in zip(kind.types, each, strict=True)]
        )

    return array(array), codegen
