"""What everything that can be probed has in common: the protocol, its state, its snapshot, its curve."""
