"""Encode, record and decode Bicode markers: a blinking LED in an acrylic ArUco plate, seen by an event camera.

The folders follow the communication link, and the files of `recognition` are the boxes of the paper's Fig. 2:

- `marker`: the transmitter (III-A), from the packet over the Manchester code to the LED on its plate.
- `camera`: a synthetic event camera, from the scene over the lens and the pixels to the readout.
- `recognition`: the paper's receiver (II), from events to the ID and the pose of each marker.
- `soft_receiver`: a receiver with soft decisions, which goes beyond the paper.
- `pose`: lock-in images, and poses from the light of the whole pattern, with covariances and odds; beyond the paper.
- `recordings`: event files of other cameras and programs, read and written.
- `fabrication`: sheets, parts list and transmitter program of a marker that can be built.

`events` defines the event type, `boxes` rectangles of pixels, `paper` the numbers that the paper states, `constants`
the constants of the synthetic camera, and `kernels` how loops over events are compiled. What the notebooks compute is
in the package `bicode_studies`.

The names below are imported when they are first used, so that importing the package takes no time. The file
``__init__.pyi`` lists them, for the import and for type checkers.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
