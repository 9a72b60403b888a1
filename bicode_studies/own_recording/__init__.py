"""Read a recording of one's own: diagnose, export, and measure the camera with a blinking LED (notebook 17)."""
