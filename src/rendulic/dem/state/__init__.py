"""The plain state of a packing: arrays and numbers, made, checked and saved."""
