"""Predictions of the paper's figures by many sets of constants: those of the posterior, and as many of the prior.

`trials_of_set` runs the conditions of a figure with a set of constants, at a reduced size; `predict` judges the claims
by them.
"""
