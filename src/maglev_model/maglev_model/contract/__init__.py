"""What the rooms of a flight have agreed on: the stage, its messages, phases and modes."""
