"""`farhand pki`: the authority that issues, renews and revokes the certificates of robots and operators.

In: names, hosts and days. Out: a folder of three files for each site, and the list of who may do what.
Next: `farhand.common.link.certificates` reads them at the sites.
"""
