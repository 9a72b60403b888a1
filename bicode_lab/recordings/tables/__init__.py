"""Read and write event files of columns: npz, npy, HDF5, MATLAB files and Parquet."""
