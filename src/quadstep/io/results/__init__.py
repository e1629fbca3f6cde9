"""Folders of results: what is written, kept, resumed and replaced in them."""
