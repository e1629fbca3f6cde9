"""Sphinx's settings. The source is what `docs.site.writing` makes; nothing is fetched from a network."""

from pathlib import Path

import quadstep

project = "quadstep"
author = "The quadstep developers"
project_copyright = "The quadstep developers, MIT licence"
version = release = quadstep.__version__

extensions = ["myst_parser"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
highlight_language = "text"
smartquotes = False  # it makes a dash of the two hyphens of an option
suppress_warnings = ["misc.highlighting_failure"]  # a frame of a law with dots in it is no Python

here = Path(__file__).parent
html_theme = "furo"
html_title = "quadstep"
html_static_path = [str(here / "static")]
html_extra_path: list[str] = []
html_css_files = ["theme.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False

BOTH = {"font-stack": '"Inter Variable", Inter, system-ui, -apple-system, "Segoe UI", sans-serif'}
html_theme_options = {
    "light_css_variables": {
        **BOTH,
        "color-brand-primary": "#0072b2",
        "color-brand-content": "#0072b2",
        "color-background-primary": "#fdfcfa",
        "color-background-secondary": "#f6f5f1",
        "color-foreground-primary": "#1c2126",
    },
    "dark_css_variables": {
        "color-brand-primary": "#4aa8e0",
        "color-brand-content": "#4aa8e0",
        "color-background-primary": "#15191d",
        "color-background-secondary": "#0f1215",
        "color-foreground-primary": "#e8e6e1",
    },
}
