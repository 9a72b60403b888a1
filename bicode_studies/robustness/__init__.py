"""Robustness, for notebook 21: IDs that are read where no marker is, and recordings that are damaged step by step.

`clutter` draws scenes without a marker and `false_ids` counts what receivers read in them. `stressors` damages
recordings of a marker, `receiver_ranges` compares how far receivers read, and `plots` draws the results.

`compare` makes the tables in which the sequential receiver and the two before it read the same recordings:
`link_conditions`, `link_scenes` and `link_trials` say of what, `earlier_receivers` and `sequential_trials` by whom, and
`never_worse` judges each condition.
"""
