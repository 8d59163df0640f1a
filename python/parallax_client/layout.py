"""The layout of every message, from `messages.json`, which `parallax messages --json` makes of the Rust definitions.

`dtype(name)` is the NumPy type of a struct. It is built with the offsets and sizes of the file, and refused if NumPy
makes another size of them.
"""

import ctypes
import functools
import json
import pathlib

import numpy as np

_ALL = json.loads(pathlib.Path(__file__).with_name("messages.json").read_text(encoding="utf-8"))
_STRUCTS = _ALL["structs"]

TOPICS = _ALL["topics"]
"""Of every kind of topic its name, version and message."""
LIMITS = _ALL["limits"]
"""The lengths of arrays in messages."""
STATUSES = _ALL["statuses"]
"""The reasons by the number of a status; 0 is "ok"."""
SIDES = _ALL["sides"]
KEPT = _ALL["kept"]
JOINT_SETS = _ALL["joint_sets"]
"""The names of the joints of every set, in order."""

OK, END = STATUSES.index("ok"), STATUSES.index("end of footage")


def reason(status):
    """The words for a status, as in the files of a run."""
    status = int(status)
    return STATUSES[status] if status < len(STATUSES) else "unknown"


@functools.lru_cache(maxsize=None)
def dtype(name):
    """The NumPy type of a struct, or of a number."""
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
        raise AssertionError(f"{name} has {layout['size']} bytes, and its fields end at {end}")
    return made


@functools.lru_cache(maxsize=None)
def ctype(name):
    """A ctypes struct with the name, size and alignment by which the transport tells types apart. Its content is bytes:
    messages are read through `dtype`."""
    layout = _STRUCTS[name]
    word = {4: ctypes.c_uint32, 8: ctypes.c_uint64}.get(layout["align"])
    if word is None:
        # Alignments above those of numbers come by `_align_`, which Python has from 3.13; see `alignments`.
        word = ctypes.c_uint64
    n = layout["size"] // ctypes.sizeof(word)
    made = type(name, (ctypes.Structure,), {
        "_fields_": [("words", word * n)],
        "type_name": staticmethod(lambda: layout["type_name"]),
    })
    if ctypes.sizeof(made) != layout["size"]:
        raise AssertionError(f"{name} has {layout['size']} bytes, ctypes makes it {ctypes.sizeof(made)}")
    return made


def alignment(name):
    """The alignment of a struct, bytes."""
    return _STRUCTS[name]["align"]
