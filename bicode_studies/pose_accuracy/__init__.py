"""How accurate poses are: the ruler, the cases, and tables of errors against the truth."""
