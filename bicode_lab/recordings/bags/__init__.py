"""Read ROS bags with events: ROS 1 (.bag) and ROS 2 (.db3, .mcap, or the folder with metadata.yaml)."""
