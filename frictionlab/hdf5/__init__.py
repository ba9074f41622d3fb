"""HDF5 files: recordings, results and, in `frictionlab.hdf5.maps`, maps that grow. h5py appears only in this room."""

from frictionlab.hdf5.arrays import arrays_inside
from frictionlab.hdf5.describe import describe
from frictionlab.hdf5.recordings import Extra, check_writable, is_recording, read_recording, write_recording
from frictionlab.hdf5.results import format_of, read_tree, write_tree

__all__ = [
    "Extra",
    "arrays_inside", "check_writable", "describe", "format_of", "is_recording", "read_recording", "read_tree",
    "write_recording",
    "write_tree",
]  # fmt: skip
