"""Read the AEDAT formats of iniVation's cameras: versions 2, 3.1 and 4."""
