"""What is proved, and the paper's equations and theorems judged. Only commands may import it."""
