"""How a text is learned from the events of one light, and checked; `soft_receiver.uart` puts it together.

- `amounts` counts the events in the bins of chips, and weighs them.
- `edge_rates` learns what an edge makes, along the likeliest path.
- `starts` says where the learning may begin, and `learn` keeps the likeliest start.
- `clock` follows the transmitter's clock, `runs` finds it anew after pauses.
- `check` decides whether a text is believed, without knowing what was sent.
"""
