"""The commands, one a module, named as they are typed.

Nothing imports it but the start, `__main__.py`.

The command line imports all of these to show its help, so a module loads at its head only what the options need; what does the
work is imported where the command runs.
"""
