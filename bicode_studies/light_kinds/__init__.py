"""How often lights are named right: synthetic lights of every kind, and a table of what each was taken for."""
