"""A machine brought up step by step, each proven before the next."""
