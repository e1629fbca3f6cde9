"""Errors and exit codes, files read with limits and written whole, documents, folders of results, users' code.

Every room may import it; it imports no other.
"""

__version__ = "0.1.0"
