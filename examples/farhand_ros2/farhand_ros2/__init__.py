"""An arm and a tracker behind ROS 2 topics, as drivers of Farhand."""
