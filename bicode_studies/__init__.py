"""What the chapters of the notebooks compute, one folder for each theme, on top of the module `bicode_lab`.

    paper_experiments/   the experiments of section IV, Figs 8 to 14          notebooks 08-14
    claims/              the paper's claims, each tested on the tables        end of 08-14
    calibration/         the free constants, fitted to Fig. 8                 notebooks 08, 19
    what_if/             other settings than the paper's, page with sliders   notebook 15
    link_budget/         expected accuracy, and the limits of the decoder     notebooks 08, 09, 16
    own_recording/       recordings of one's own, and why an ID is missing    notebook 17
    real_light/          recordings of real lights                            notebooks 18, 19
    bench/               run times of receiver and simulated camera           notebook 20
    robustness/          false IDs, and accuracy on degraded recordings       notebook 21

Chapters share `trial` (record a scene once, read it with every receiver), `score` (what is right), `statistics`
(intervals and ranges), `sweep/` (many trials in parallel, each kept), `plots/`, `notebook/` (figures and parameters of
notebooks), `cli/` (the command ``bicode``) and `repository` (where files are). Notebooks 00 to 07 need little of this:
they teach `bicode_lab` itself.
"""
