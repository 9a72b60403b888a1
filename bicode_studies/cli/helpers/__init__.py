"""What several commands share: output files, compiled kernels, settings of a marker, camera files and progress."""
