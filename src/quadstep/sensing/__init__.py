"""What the controller measures: noise, bias, latency, sample rates, and an estimator that fuses the measurements.

Laws over numbers; rooms from `metrics` up may import it.
"""
