"""What runs at each sample, compiled."""
