"""Exchange with the robot over the link: requests until answered, reports, events, models, stops.

In: what to send, and the robot's messages. Out: answers and the newest state of the robot. Next:
`farhand.local_site.console.console` acts on them.
"""
