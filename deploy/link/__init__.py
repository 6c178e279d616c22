"""The link process: a relay of TCP and UDP between the sites that delays, loses, paces, stalls and cuts, and its control socket.

In: bytes of one site, settings. Out: the same bytes, later, or not, at the other. Next: `farhand.common.impairment.impairment` decides when.
"""
