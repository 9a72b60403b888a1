"""What if (notebook 15 and ``bicode what-if``): how well a marker is read when it is built otherwise than the paper's.

- `choice`: one choice of the settings, and remarks on what is wrong with it.
- `packet_timing`: the arithmetic of packets in periods.
- `ask`: a recording of a choice, and what the receiver reads in it.
- `packet_view`: one packet of a recording, ready to draw.
- `plots`: the figures of notebook 15.
- `page`, `page_pictures` and ``page.css``: the page with sliders.
"""
