"""The experiments of section IV of the paper, Figs 8 to 14, for notebooks 08 to 14.

`conditions`, `scenes` and `grids` say what is recorded, `trial_rows` runs one trial of it, and `results` keeps the
tables of all trials. `variants` runs the few trials that explain a curve; `swelling`, `range_limits`,
`processing_limit`, `motion_loss` and `background_rate` hold the explanations. `frames_of_fig_13` makes the frames of
Fig. 13; files `plots_...` draw.
"""
