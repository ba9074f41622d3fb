"""A map of steady states in a file.

The tree, format version 1::

    /               attrs: format, format_version, frictionlab_version, and what holds for the whole map
    /r, /beta ...   (n,) float64, dimension scales
    /KEY            over all axes; float64 (NaN: not known) or ASCII text of fixed length (empty: not known)
    /wall           over all axes, the same at each point: stored once, as the value of what is not written
    /warnings       over all axes, uint32: CF flag_masks and flag_meanings, and flag_sentences (one for each, in words)
    (each with units and long_name, from `frictionlab.schema`)
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.files import write_whole
from frictionlab.hdf5.opening import format_of, new_file
from frictionlab.schema import STEADY_STATES

FORMAT = "frictionlab map"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class MapLayout:
    """What a map's file is made of beside its numbers.

    ``axes``: name and values of each dimension, the last one fastest; ``kinds``: key and type (``float64``, ``S11``) of
    each dataset; ``attributes``: what holds for the whole map; ``words``: what a dimension is that `frictionlab.schema`
    does not list, a law's parameter; ``flags``: of each key that holds flags, meaning -> its bit and what it says.
    """

    axes: Mapping[str, FloatArray]
    kinds: Mapping[str, str]
    attributes: Mapping[str, str]
    words: Mapping[str, str] = field(default_factory=dict)
    flags: Mapping[str, Mapping[str, tuple[int, str]]] = field(default_factory=dict)

    def write(self, records: NDArray[np.void], path: Path, *, force: bool = False) -> None:
        """Write the file of these results, one record with all keys a point, whole or not at all."""
        pieces = new_file(partial(self._fill, records), format=FORMAT, format_version=FORMAT_VERSION)
        write_whole(path, pieces, replace=force or is_map)

    def _fill(self, records: NDArray[np.void], tree: h5py.File) -> None:
        tree.attrs.update(self.attributes)
        shape, scales = tuple(len(values) for values in self.axes.values()), []
        for name, values in self.axes.items():
            axis = tree.create_dataset(name, data=np.asarray(values, dtype=np.float64))
            axis.make_scale(name)
            axis.attrs.update(_described(name) or {"units": "1", "long_name": self.words.get(name, name)})
            scales.append(axis)
        data = [tree.create_dataset(key, data=records[key].reshape(shape)) for key in self.kinds]
        for key in (name for name in self.attributes if STEADY_STATES.column(name) is not None):
            word = self.attributes[key].encode()
            data.append(tree.create_dataset(key, shape, f"S{len(word)}", fillvalue=word))
        for dataset in data:
            for dimension, scale in zip(dataset.dims, scales, strict=True):
                dimension.attach_scale(scale)
            key = dataset.name.lstrip("/")
            dataset.attrs.update(_described(key))
            if flags := self.flags.get(key):  # as CF conventions have them, and each in words
                dataset.attrs["flag_masks"] = np.array([bit for bit, _ in flags.values()], dataset.dtype)
                dataset.attrs["flag_meanings"] = " ".join(flags)
                dataset.attrs["flag_sentences"] = [sentence for _, sentence in flags.values()]


def _described(name: str) -> dict[str, str]:
    column = STEADY_STATES.column(name)
    return {} if column is None else {"units": column.units, "long_name": column.sentence}


def is_map(path: Path) -> bool:
    """Whether this file is a map of this package."""
    return format_of(path) == FORMAT
