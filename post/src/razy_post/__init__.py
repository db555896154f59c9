"""Read and plot the HDF5 result files of razy."""

__version__ = "0.2.0"
