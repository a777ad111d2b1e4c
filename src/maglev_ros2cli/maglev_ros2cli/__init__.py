"""``ros2`` for where ROS 2 comes without it: a subset of ros2cli, told and answered as that is."""
