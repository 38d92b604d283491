"""What is controlled, along which path, in which directions."""
