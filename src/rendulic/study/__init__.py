"""Studies: what they consist of, and the stages that carry them out."""
