"""Reference trajectories of the maglev stage, and their node."""
