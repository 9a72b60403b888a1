"""The stand-in board is not a test: it runs in a process of its own."""

collect_ignore = ["board"]
