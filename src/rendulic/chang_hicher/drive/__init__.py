"""What changes a material point: paths, bursts, many parameter sets."""
