"""The closed loop, the engines that fly it, and the log."""
