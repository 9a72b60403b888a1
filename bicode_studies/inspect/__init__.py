"""Look at a recording: its health, what a receiver made of it in words, and which other settings would read it."""
