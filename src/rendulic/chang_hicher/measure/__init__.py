"""What a state of the Chang-Hicher model tells, by looking only: planes, tangents, failure modes, cones."""
