"""The operator's site: demonstrations, learning, commands, the view."""
