"""What can happen to a file's bytes, to the text in it, and to the tree of an HDF5 file."""

import contextlib
import io
import math
from collections.abc import Callable

import h5py
import numpy as np

HEAD = 3000  # bytes in which half of the damage is done: an HDF5 file says there what it holds
WORDS = (
    "nan", "inf", "-inf", "1e308", "1e999", "9" * 400, "-1", "0", '""', "'", "\0", "\x1b[31m", "é", "\ud800", "[[[[",
    "{", "=1+1", "..", "../../x", "x" * 9000, "\r", "\n", "\ufeff", "[" * 3000, '{"a":' * 3000, "2020-01-01", "0x1F",
)  # fmt: skip

Bytes = Callable[[bytes, np.random.Generator], bytes]


def flipped(raw: bytes, rng: np.random.Generator) -> bytes:
    data = bytearray(raw)
    reach = len(data) if rng.random() < 0.5 else min(len(data), HEAD)
    for _ in range(int(rng.choice([1, 2, 5, 20]))):
        data[int(rng.integers(reach))] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFF, int(rng.integers(256))]))
    return bytes(data)


def cut(raw: bytes, rng: np.random.Generator) -> bytes:
    return raw[: int(rng.integers(len(raw)))]


def moved(raw: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes are copied over others: addresses and lengths that are true elsewhere."""
    data, size = bytearray(raw), int(rng.choice([4, 8, 16, 64]))
    reach = max(len(data) - size, 1)
    source, to = int(rng.integers(reach)), int(rng.integers(min(reach, HEAD) if rng.random() < 0.5 else reach))
    data[to : to + size] = data[source : source + size]
    return bytes(data)


def word(raw: bytes, rng: np.random.Generator) -> bytes:
    at, end = sorted(int(n) for n in rng.integers(len(raw) + 1, size=2))
    said = WORDS[int(rng.integers(len(WORDS)))].encode("utf-8", "surrogatepass")
    return raw[:at] + said + raw[min(end, at + int(rng.integers(20))) :]


def value(raw: bytes, rng: np.random.Generator) -> bytes:
    """One value of a line is another: behind an equals sign, a colon or a comma."""
    lines = raw.split(b"\n")
    at = int(rng.integers(len(lines)))
    mark = (b"=", b":", b",")[int(rng.integers(3))]
    cells = lines[at].split(mark)
    said = WORDS[int(rng.integers(len(WORDS)))].encode("utf-8", "surrogatepass")
    cells[int(rng.integers(len(cells)))] = said
    lines[at] = mark.join(cells)
    return b"\n".join(lines)


def shuffled(raw: bytes, rng: np.random.Generator) -> bytes:
    lines = raw.split(b"\n")
    a, b = (int(n) for n in rng.integers(len(lines), size=2))
    lines[a] = lines[b]
    return b"\n".join(lines)


BINARY: tuple[Bytes, ...] = (flipped, flipped, flipped, moved, moved, cut)
TEXT: tuple[Bytes, ...] = (flipped, cut, word, word, value, value, value, shuffled)


def hurt(raw: bytes, rng: np.random.Generator) -> bytes:
    """A file that is sound HDF5 and holds what no file of its kind holds."""
    file_ = io.BytesIO(raw)
    with h5py.File(file_, "r+") as file:
        for _ in range(int(rng.integers(1, 3))):
            names: list[str] = []
            file.visit(names.append)
            name = names[int(rng.integers(len(names)))]
            with contextlib.suppress(KeyError, OSError, TypeError, ValueError):  # gone or another by the change before
                HURTS[int(rng.integers(len(HURTS)))](file, name, rng)
    return file_.getvalue()


def _replace(file: h5py.File, name: str, new: object, **how: object) -> None:
    del file[name]
    file.create_dataset(name, data=new, **how)


def _attribute(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    values = [
        file.ref,
        np.zeros(3, [("a", "f8"), ("b", "S3")]),
        np.array([[1, 2], [3, 4]], "u1"),
        np.array(["a", "b"], h5py.string_dtype()),
        b"\xff\xfe",
        10**15,
        math.nan,
        np.zeros(5),
        np.zeros((2, 2)),
        "x" * 60000,
        np.array([b"a"]),
        h5py.Empty("f8"),
        -1,
    ]
    node = file[name] if rng.random() < 0.7 else file
    keys = list(node.attrs) or ["format"]
    node.attrs[keys[int(rng.integers(len(keys)))]] = values[int(rng.integers(len(values)))]


def _lose_attribute(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    keys = list(file[name].attrs)
    if keys:
        del file[name].attrs[keys[int(rng.integers(len(keys)))]]


def _type(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    kinds: list[object] = [
        np.zeros(300, "f4"), np.zeros(300, "c16"), np.zeros(300, "i8"), np.zeros(300, ">f8"), np.zeros((300, 2)),
        np.float64(1.0), np.zeros(300, [("a", "f8")]), np.full(300, np.nan), np.full(300, 1e308), np.zeros(0),
        np.array([b"x"] * 300), np.zeros(300, bool), np.arange(300)[::-1] * 1.0, np.full(300, np.inf),
    ]  # fmt: skip
    _replace(file, name, kinds[int(rng.integers(len(kinds)))])


def _huge(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    """An array that claims more than any memory holds, of which nothing is stored."""
    del file[name]
    shape = [(1 << 40,), (1 << 33,), (1 << 20, 1 << 20), (1 << 62,)][int(rng.integers(4))]
    file.create_dataset(name, shape, "f8" if shape[0] < 1 << 60 else "u1", chunks=tuple(min(s, 1024) for s in shape))


def _link(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    links = [
        h5py.ExternalLink("/etc/passwd", "/x"),
        h5py.SoftLink("/nowhere"),
        h5py.SoftLink(f"/{name}"),
        h5py.SoftLink("/"),
    ]
    del file[name]
    file[name] = links[int(rng.integers(len(links)))]


def _cycle(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    """A group that is inside itself."""
    node = file[name]
    group = node if isinstance(node, h5py.Group) else file["source"]
    group[f"again{int(rng.integers(9))}"] = file["/"] if rng.random() < 0.5 else group


def _texts(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    strange = [[b"\xff"] * 3, ["\x1b[31m"], ["x" * 100000], []]
    _replace(file, name, strange[int(rng.integers(4))], dtype=h5py.string_dtype())


def _storage(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    """The same numbers stored in another way, or somewhere else."""
    old = file[name]
    if not isinstance(old, h5py.Dataset):
        return
    values, shape = old[()], old.shape or (1,)
    del file[name]
    how = int(rng.integers(6))
    if how == 0:
        layout = h5py.VirtualLayout(shape, "f8")
        layout[...] = h5py.VirtualSource("/etc/passwd", "x", shape)
        file.create_virtual_dataset(name, layout)
    elif how == 1:
        file.create_dataset(name, shape, "f8", external=[("/etc/passwd", 0, 8 * int(np.prod(shape)))])
    else:
        filters: list[dict[str, object]] = [
            {"compression": "gzip", "shuffle": True},
            {"compression": "lzf"},
            {"fletcher32": True},
            {"scaleoffset": 3},
        ]
        file.create_dataset(name, data=values, chunks=True, **filters[how - 2])


def _strange(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    """What stands there is no array of numbers, though HDF5 knows it."""
    kinds: list[tuple[object, object]] = [
        ([file.ref] * 5, h5py.ref_dtype),
        (np.zeros(800, "u1"), h5py.enum_dtype({"GOOD": 0, "BAD": 1}, "u1")),
        (h5py.Empty("f8"), None),
        (np.zeros((1,) * 32), None),
        (np.zeros(800, "f2"), None),
        (np.zeros(800, "S0" if rng.random() < 0.1 else "S5"), None),
        (np.zeros(800, "u8") + np.uint64(2**64 - 1), None),
    ]
    data, dtype = kinds[int(rng.integers(len(kinds)))]
    del file[name]
    if rng.random() < 0.1:
        file[name] = np.dtype("f8")  # a type with a name
    else:
        file.create_dataset(name, data=data, dtype=dtype)


def _more(file: h5py.File, name: str, rng: np.random.Generator) -> None:
    """Members that nobody asked for."""
    names = ("x" * 5000, "\u202e", "..", "é\u0301", "a b\n", "#refs#", "\x1b[31m")
    node = file[name] if isinstance(file[name], h5py.Group) else file
    node.create_dataset(names[int(rng.integers(len(names)))], data=np.arange(5.0))


def _away(file: h5py.File, name: str, _rng: np.random.Generator) -> None:
    del file[name]


def _group(file: h5py.File, name: str, _rng: np.random.Generator) -> None:
    del file[name]
    file.create_group(name)


HURTS = (
    _attribute, _attribute, _lose_attribute, _type, _type, _huge, _link, _cycle, _texts, _away, _group, _storage,
    _strange, _more,
)  # fmt: skip
