"""Commands that compare receivers with each other."""
