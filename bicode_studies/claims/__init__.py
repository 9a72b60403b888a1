"""Verdicts on the paper's claims: `data/paper_claims.csv` holds the claims, `results/` the trials that judge them."""
