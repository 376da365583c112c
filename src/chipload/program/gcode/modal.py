"""Which codes may stand together in a block, and which words need which code.

Notation: G codes in tenths. Two codes of one group exclude each other. ``motion`` is the code of motion that a block is
carried out with: its own, or the one that lasts when the block gives axes.

Reference: LinuxCNC 2.9, "Modal Groups" and "Order of Execution"; what its interpreter was observed to refuse.
"""

from __future__ import annotations

from chipload.errors import InputError
from chipload.program.control import ModalRules
from chipload.program.gcode.cycles import CYCLES, FANUC_BACK_BORING, NEED_P, NEED_Q
from chipload.program.gcode.state import NO_MOTION, State
from chipload.program.gcode.words import Block

#: groups of G codes: one code of each in a block
GROUPS: dict[str, tuple[int, ...]] = {
    "once": (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
    "motion": (0, 10, 20, 30, 50, 51, 52, 53, 62, 330, 331, 382, 383, 384, 385, 760, *sorted(CYCLES)),
    "none": (NO_MOTION,),
    "plane": (170, 171, 180, 181, 190, 191),
    "distance": (900, 910),
    "centre": (901, 911),
    "feed": (930, 940, 950),
    "units": (200, 210),
    "compensation": (400, 410, 411, 420, 421),
    "length": (430, 431, 432, 434, 490),
    "retract": (980, 990),
    "offset": (540, 550, 560, 570, 580, 590, 591, 592, 593),
    "path": (610, 611, 640),
    "spindle": (960, 970),
    "lathe": (70, 80),
}
GROUP_OF = {code: name for name, codes in GROUPS.items() for code in codes}
#: groups of M codes
M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60, 99),
    "output": (62, 63, 64, 65, 66, 67, 68),
    "tool": (6, 61),
    "spindle": (3, 4, 5, 19),
    "coolant": (7, 8, 9),
    "override": (48, 49, 50, 51, 52, 53),
    "saved": (70, 71, 72, 73),
    "call": (98,),
    "tcp": (428, 429, 430),
}
M_GROUP_OF = {code: name for name, codes in M_GROUPS.items() for code in codes}
#: M codes that a builder may define
USER_M = range(100, 200)
MOST_M = 4
_AXES = frozenset("xyzabcuvw")
#: codes outside motion that use up axis words
COVET = frozenset({100, 280, 300, 520, 920})
_NOT_ALONE = frozenset({382, 383, 384, 385, 50, 51, 52, 760, 330, 331})

#: letter -> (codes of motion, other G codes, M codes) that use it
USES: dict[str, tuple[frozenset[int], frozenset[int], frozenset[int]]] = {
    "d": (frozenset(), frozenset({410, 411, 420, 421, 960}), frozenset()),
    "e": (frozenset({760}), frozenset(), frozenset({66, 67, 68})),
    "h": (frozenset({760}), frozenset({430, 432, 434}), frozenset()),
    "i": (frozenset({20, 30, 50, 51, 331, 760, 870, FANUC_BACK_BORING}), frozenset({100}), frozenset()),
    "j": (frozenset({20, 30, 50, 51, 760, 870, FANUC_BACK_BORING}), frozenset({100}), frozenset()),
    "k": (frozenset({20, 30, 62, 330, 331, 760, 870}), frozenset(), frozenset()),
    "l": (CYCLES | {52, 53, 760}, frozenset({100, 410, 411, 420, 421}), frozenset({66, 98})),
    "p": (
        NEED_P | {20, 30, 50, 52, 62, 740, 760, 840, FANUC_BACK_BORING},
        frozenset({40, 100, 640}),
        frozenset({*range(50, 54), *range(62, 67), 19, 98}),
    ),
    "q": (NEED_Q | {50, 62, 760}, frozenset({100, 640}), frozenset({19, 61, 66, 67, 68})),
    "r": (CYCLES | {20, 30, 62, 760}, frozenset({100, 640}), frozenset({19})),
    "$": (frozenset({330, 331, 740, 760, 840}), frozenset({950, 960, 970}), frozenset({3, 4, 5, 19, 51})),
}


def code_text(code: int) -> str:
    """G code in tenths as text.

    >>> code_text(382), code_text(10)
    ('G38.2', 'G1')
    """
    return f"G{code // 10}.{code % 10}" if code % 10 else f"G{code // 10}"


def has_axes(block: Block) -> bool:
    """Whether a word of an axis, or of a pole, stands in the block."""
    words = block.words
    return not _AXES.isdisjoint(words) or "@" in words or "^" in words


#: groups whose last code stays active behind a canned cycle (group 01 of a Fanuc)
GROUP_ONE = frozenset({0, 10, 20, 30, 330})


def check_codes(block: Block, rules: ModalRules) -> dict[str, int]:
    """Codes of the block by group; refuses unknown codes and, unless the last one counts, two of one group."""
    found: dict[str, int] = {}
    for code in block.g:
        group = "cycle" if rules.cycle_group and (code in CYCLES or code == NO_MOTION) else GROUP_OF.get(code)
        if group is None:
            raise InputError(
                f"{code_text(code)}: is not a code of LinuxCNC: remove it, or read the text in its own dialect"
            )
        if group in found and not rules.last_code_wins:
            raise InputError(f"{code_text(found[group])} and {code_text(code)}: exclude each other in one block")
        found[group] = code
    if rules.last_code_wins:
        return found
    if len(block.m) > MOST_M:
        raise InputError(f"{len(block.m)} M codes: a block has at most {MOST_M}")
    seen: dict[str, int] = {}
    for m in block.m:
        group = M_GROUP_OF.get(m, "user" if m in USER_M else None)
        if group is None:
            raise InputError(f"M{m}: is not a code of LinuxCNC: remove it, or read the text in its own dialect")
        if group in seen:
            raise InputError(f"M{seen[group]} and M{m}: exclude each other in one block")
        seen[group] = m
    return found


def motion_of(block: Block, codes: dict[str, int], lasting: int) -> int:
    """Code of the motion that the block asks for, -1 for none.

    Raises
    ------
    InputError
        Axes are given and nothing uses them, or two codes do.
    """
    own, once, axes = codes.get("motion", codes.get("none", -1)), codes.get("once", -1), has_axes(block)
    covets = once in COVET
    if own == NO_MOTION:
        if axes and not covets:
            raise InputError("G80: ends the motion and takes no axes: write G0 or G1")
        return NO_MOTION
    if own >= 0:
        if covets:
            raise InputError(f"{code_text(once)} and {code_text(own)}: both use the axes: write two blocks")
        if own in _NOT_ALONE and not axes and own not in (52,):
            raise InputError(f"{code_text(own)}: needs at least one axis")
        return own
    if axes and not covets and codes.get("length") != 431:
        if lasting == NO_MOTION:
            raise InputError("axes are given and no code that moves them is active: write G0 or G1")
        return lasting
    return -1


def motion_of_group_one(block: Block, codes: dict[str, int], state: State) -> int:
    """Code of the motion of a block, -1 for none, where cycles are a group of their own.

    G80 ends a cycle, and the code of G0 to G3 that was active before it moves the axes of its block. Of a cycle and one
    of G0 to G3 in one block the last counts. Beside a code that acts once, G0 to G3 only becomes active.
    """
    own, cycle, axes = codes.get("motion", -1), codes.get("cycle", -1), has_axes(block)
    if own in GROUP_ONE:
        state.group_one = own
    covets = codes.get("once", -1) in COVET
    if covets and own in GROUP_ONE:
        state.motion = own
        return -1
    if cycle == NO_MOTION or (cycle >= 0 and own >= 0 and block.g.index(own) > block.g.index(cycle)):
        state.motion = state.group_one
        cycle = -1
    if cycle >= 0:
        return cycle
    if own >= 0:
        return motion_of(block, codes, state.motion)
    return state.motion if axes and not covets and codes.get("length") != 431 else -1


def unused_letters(block: Block, motion: int) -> list[str]:
    """Letters of words that no code of the block uses."""
    g, m = block.g, block.m
    out = []
    for letter in sorted(block.words.keys() & USES.keys()):
        motions, codes, stops = USES[letter]
        if not (motion in motions or any(x in codes for x in g) or any(x in stops or x in USER_M for x in m)):
            out.append(letter)
    return out
