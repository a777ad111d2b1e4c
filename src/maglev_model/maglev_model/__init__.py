"""The machine, written once: its physics, geometry and parameters. No ROS here."""
