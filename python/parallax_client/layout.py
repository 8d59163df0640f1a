"""Layouts of all messages, from `messages.json`. `parallax messages --json` generates this file from the Rust definitions.

`dtype(name)` returns the NumPy type of a struct. It is built with the offsets and sizes in the file. A different
size in NumPy is an error.
"""

import ctypes
import functools
import json
import pathlib

import numpy as np

_ALL = json.loads(pathlib.Path(__file__).with_name("messages.json").read_text(encoding="utf-8"))
_STRUCTS = _ALL["structs"]

TOPICS = _ALL["topics"]
"""Name, version and message of every kind of topic."""
LIMITS = _ALL["limits"]
"""Lengths of arrays in messages."""
STATUSES = _ALL["statuses"]
"""Texts of the statuses by number; 0 is "ok"."""
SIDES = _ALL["sides"]
KEPT = _ALL["kept"]
JOINT_SETS = _ALL["joint_sets"]
"""Names of the joints in every joint set, in order."""

OK, END = STATUSES.index("ok"), STATUSES.index("end of footage")


def reason(status):
    """Returns the text of a status, as in the files of a run."""
    status = int(status)
    return STATUSES[status] if status < len(STATUSES) else "unknown"


@functools.lru_cache(maxsize=None)
def dtype(name):
    """Returns the NumPy type of a struct or a number."""
    if name not in _STRUCTS:
        return np.dtype(name)
    layout = _STRUCTS[name]
    names, formats, offsets = [], [], []
    for field, kind, lengths, offset in layout["fields"]:
        names.append(field)
        formats.append((dtype(kind), tuple(lengths)) if lengths else dtype(kind))
        offsets.append(offset)
    made = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": layout["size"]})
    end = offsets[-1] + made.fields[names[-1]][0].itemsize
    if end != layout["size"]:
        raise AssertionError(f"{name} has {layout['size']} bytes, but its fields end at {end}")
    return made


@functools.lru_cache(maxsize=None)
def ctype(name):
    """Returns a ctypes struct with the name, size and alignment by which the transport distinguishes types. The struct
    contains only bytes: messages are read through `dtype`."""
    layout = _STRUCTS[name]
    word = {4: ctypes.c_uint32, 8: ctypes.c_uint64}.get(layout["align"])
    if word is None:
        # Alignments above those of numbers need `_align_`, which exists since Python 3.13; see `alignment`.
        word = ctypes.c_uint64
    n = layout["size"] // ctypes.sizeof(word)
    made = type(name, (ctypes.Structure,), {
        "_fields_": [("words", word * n)],
        "type_name": staticmethod(lambda: layout["type_name"]),
    })
    if ctypes.sizeof(made) != layout["size"]:
        raise AssertionError(f"{name} has {layout['size']} bytes, but {ctypes.sizeof(made)} in ctypes")
    return made


def alignment(name):
    """Returns the alignment of a struct, in bytes."""
    return _STRUCTS[name]["align"]
