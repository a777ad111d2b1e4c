"""What the programs have in common: arguments, output, signals, versions."""
