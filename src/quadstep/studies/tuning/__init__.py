"""Gains found by flying: CMA-ES over many flights at once, under the controller's own conditions."""
