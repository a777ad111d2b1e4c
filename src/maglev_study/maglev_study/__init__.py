"""Studies of the stage that no flight needs: the closed loop as a library, comparison, tables."""
