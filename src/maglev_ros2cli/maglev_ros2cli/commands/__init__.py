"""The commands: each module's ``add`` gives its verbs to a parser."""
