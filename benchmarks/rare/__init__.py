"""Ten cases of small probabilities, fixed before any was estimated: do the intervals hold the truth, and what do they cost?"""
