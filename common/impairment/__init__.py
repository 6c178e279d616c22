"""Impaired links: delay, jitter, loss, rate and outages, for the relay and for links in virtual time.

In: settings and profiles (TOML). Out: when each byte or message arrives, as pure functions of a seed and a
clock. Next: `farhand.deploy.link` applies them to real sockets.
"""
