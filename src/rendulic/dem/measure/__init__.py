"""What a packing tells; nothing here changes it."""
