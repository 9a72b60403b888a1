"""Accuracies with their intervals, and ranges: each is defined here once, for all studies."""

from bicode_studies.statistics.accuracies import accuracy_curves, over_seeds, range_over_seeds
from bicode_studies.statistics.intervals import LEVEL, interval_of_mean, interval_of_sum, wilson
from bicode_studies.statistics.ranges import HALF, Floats, last_reached, range_with_ends, ranges_m
from bicode_studies.statistics.seeds import interval_over_seeds

__all__ = [
    "HALF",
    "LEVEL",
    "Floats",
    "accuracy_curves",
    "interval_of_mean",
    "interval_of_sum",
    "interval_over_seeds",
    "last_reached",
    "over_seeds",
    "range_over_seeds",
    "range_with_ends",
    "ranges_m",
    "wilson",
]
