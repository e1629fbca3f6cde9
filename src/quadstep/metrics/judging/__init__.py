"""Whether flights are good enough, for machines: verdicts as one JSON object, a JUnit file, an exit code."""
