"""Robot's camera, in a process of its own: pictures of the receptacle for the operator's page.

In: the robot's reports, and requests of sites that look. Out: JPEG pictures at a rate and size that fit the link. Next: the
link; nothing of the robot depends on this folder.
"""
