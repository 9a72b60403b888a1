"""Calibration of the synthetic camera, for notebooks 08 and 19.

`candidates`, `cells` and `search` fit the free constants to Fig. 8; `other_claims` fits the four that Fig. 8 does not
determine; `plots` draws both.
"""
