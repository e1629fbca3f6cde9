"""Results for people: CSV files, figures and pages.

Rooms from `mission` up may import it.
"""
