"""bicode_lab: to be filled."""
