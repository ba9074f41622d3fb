"""HDF5 files: recordings, results and maps of steady states; h5py is only in this folder."""

from frictionlab.hdf5.opening import format_of as format_of
from frictionlab.hdf5.recordings import check_writable as check_writable
from frictionlab.hdf5.recordings import is_recording as is_recording
from frictionlab.hdf5.recordings import read_recording as read_recording
from frictionlab.hdf5.recordings import write_recording as write_recording
from frictionlab.hdf5.trees import arrays_inside as arrays_inside
from frictionlab.hdf5.trees import describe as describe
from frictionlab.hdf5.trees import matlab_inside as matlab_inside
from frictionlab.hdf5.trees import read_tree as read_tree
from frictionlab.hdf5.trees import write_tree as write_tree
