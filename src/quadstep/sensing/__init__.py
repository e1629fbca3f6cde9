"""What the controller gets to know: noise, bias, latency, rates, and an estimator that puts the measurements together.

Laws over numbers; rooms from `metrics` up may import it.
"""
