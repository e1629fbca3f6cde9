"""What a flight is made of, before any of it is chosen: controller and gains, plant, air, reference, clock, log, metric.

Users subclass these, through `quadstep.own`. Every room above `numbers` may import it.
"""
