"""Many trials in parallel: workers here or on a cluster, a store of finished trials, and the digest of their code."""
