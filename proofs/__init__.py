"""Statements emitted from the functions that fly, and their proofs: `make proofs`."""
