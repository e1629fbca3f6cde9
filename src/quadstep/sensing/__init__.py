"""What the controller gets to know: noise, bias, latency, rates, and an estimator that puts the measurements together."""
