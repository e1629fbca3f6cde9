"""The documentation: pages in Markdown, the modules that draw their figures, and `site/`, which runs and builds it all."""
