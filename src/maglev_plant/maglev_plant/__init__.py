"""The plant of the maglev stage: physics, encoders, amplifiers, and its node."""
