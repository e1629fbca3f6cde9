"""Many flights that vary as a file says: drawn, flown, stored, and summarised with intervals. Its limits are here, so that the
command line need not load the rest.
"""

MOST_FLIGHTS = 10**9
"""Most flights of one campaign; the random numbers distinguish 2^32."""

LARGEST_CHUNK = 2**20
"""Most flights in one file of results: they are in memory together, 100 bytes or more each."""

MOST_CHUNKS = 20_000
"""Most files of one campaign: its manifest names each file and is rewritten with each."""
