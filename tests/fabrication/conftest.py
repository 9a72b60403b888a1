"""Leave the stand-in board out of the tests: it runs in a process of its own."""

collect_ignore = ["board"]
