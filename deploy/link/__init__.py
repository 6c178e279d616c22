"""The link process: a relay between the sites that delays, paces, stalls and cuts, and its control socket.

In: bytes of one site, settings. Out: the same bytes, later, at the other. Next: `farhand.common.impairment.impairment` decides when.
"""
