"""What every node of the maglev stage stands on."""
