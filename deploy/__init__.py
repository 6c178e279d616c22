"""How Farhand is started: the command line, the processes, the link relay, the configurations."""
