"""The folder of a study: finished units, found by the hash of what they were made from."""
