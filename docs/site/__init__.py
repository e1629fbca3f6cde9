"""`make docs`: runs every listing of the documentation, generates its reference, and builds the site. See docs/writing.md."""
