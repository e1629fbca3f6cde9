"""What is proved, and the paper's equations and theorems judged. Only its commands import it."""
