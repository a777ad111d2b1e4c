"""The real stage behind the stage contract."""
