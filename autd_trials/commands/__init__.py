"""The commands: one module each, with `add_arguments` and `execute`.

Heavy packages are imported in `execute`, so that help and errors come at once.
"""
