"""What people read: report, plots, tables."""
