"""One flight, from mission file to folder, and the same from Python."""
