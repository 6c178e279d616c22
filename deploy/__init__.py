"""Start of Farhand: the command line, the processes and their configurations.

In: arguments and TOML files. Out: running sites, a link, results. Next: `farhand.local_site.site`,
`farhand.remote_site.site`, `link`.
"""
