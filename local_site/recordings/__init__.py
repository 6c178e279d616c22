"""Recordings of other people and other programs: tables of columns are read, understood and made demonstrations.

In: files of anybody (CSV, rosbag2, MCAP, LeRobot, robomimic, research sets) and what the user says about them.
Out: `Demonstration` files, and in words how each file was understood. Next: `farhand.local_site.teaching` learns them.
"""
