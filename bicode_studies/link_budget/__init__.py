"""Link budget (notebooks 08, 09 and 16): how often an ID is expected to be read, worked out without a recording.

- `budget`: from size, current, distance, lens and light to the accuracy of the ID.
- `edge_probability`, `region_probability`: the two steps of it that concern single pixels.
- `decoder_limits`: how many events the decoder needs, by theory and by trial, without a camera.
- `paper_ranges`: the budget beside the paper's ranges and beside recordings.
- `plots`: the figures of notebook 16.
"""
