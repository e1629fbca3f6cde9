"""Other people's simulators: their vehicles under our controllers, their controllers on our vehicles."""
