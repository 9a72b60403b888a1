"""Learn, reproduce and extend Bicode: one LED in an acrylic ArUco plate, read by an event camera.

The folders are the communication link; the files of `recognition` are the boxes of the
paper's Fig. 2, in order::

    marker/     packet -> manchester -> led, on a board                          (III-A)
    camera/     motion, optics, glow -> sensor -> readout -> record              events
    recognition/
        accumulate (a, b, d, e) -> marker_2d (c)                                 pose
                                -> regions, track (f) -> led_state, decode (g)   ID
        recognise   one period after the other
    evaluation/ how often that is right                                          (IV)

`events` and `recordings` hold what flows between them, `paper` what the paper states,
`plots` draws, `lab` is what notebooks and the command line share.
"""
