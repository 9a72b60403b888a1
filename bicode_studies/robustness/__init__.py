"""Robustness, for notebook 21: IDs that are read where no marker is, and recordings that are damaged step by step.

`clutter` draws scenes without a marker and `false_ids` counts what receivers read in them. `stressors` damages
recordings of a marker, `receiver_ranges` compares how far receivers read, and `plots` draws the results.
"""
