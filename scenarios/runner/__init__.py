"""Runs the graph: options, the nodes' lives and ends, what a run leaves. Needs no ROS itself."""
