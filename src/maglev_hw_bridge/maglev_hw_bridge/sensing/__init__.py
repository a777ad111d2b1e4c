"""Which encoders can be believed, and where the platen is."""
