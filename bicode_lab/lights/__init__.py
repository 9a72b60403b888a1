"""Tell what a light is from some 50 ms of its events, and read the codes of lights that are no marker.

- `sample` thins the events of a region, and lists the clocks that they may follow.
- `fit` fits one clock: when edges come, how many events they make, and what comes by chance.
- `codes` says what each kind of light may do from one tick of the clock to the next; `forward` adds up all of it.
- `name` compares the kinds and names the light: `name_light`.
- `moving` tells a moving edge, which passes the pixels one after the other, from a light.
- `interval_line` and `frequency` are two more line codes, their waveforms and their readers.
"""
