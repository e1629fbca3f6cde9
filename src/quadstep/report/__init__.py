"""What a person gets: CSV files, figures, pages, tables on the screen."""
