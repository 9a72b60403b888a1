"""Calibration of the synthetic camera, for notebooks 08 and 19.

`prior` says what is known of the fitted constants beforehand, `cells` tries a candidate on Fig. 8, `evidence` compares
it with measurements, and `distance` adds both up. `population` is the method, `posterior` the run. `other_claims` fits
the four constants that Fig. 8 does not determine; `plots` draws.
"""
