"""Operator's site: demonstrations, learning, commands and the page.

In: the operator's hand, clicks, and the robot's reports. Out: learned models, commands, stops. Next: `site`
starts everything; the flow is workcell -> teaching -> learning -> console -> exchange, drawn by `view`.
"""
