"""Pages of the reference that are made from the code: commands, keys of files, the Python interface, the equations."""
