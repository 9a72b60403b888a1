"""Recordings of real lights: public LED beacons (notebook 18), and blinks and noise of a real camera (notebook 19)."""
