"""Read and write event files of words: RAW (EVT2, EVT2.1, EVT3, EVT4), DAT and Event Stream."""
