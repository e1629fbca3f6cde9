"""Results for people: CSV files, figures and pages."""
