"""What changes a packing: loading, rest, growth, probes, bursts."""
