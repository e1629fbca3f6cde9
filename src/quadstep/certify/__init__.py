"""`quadstep certify`: what Theorem 5.1 asks for and promises, measured on one flight. See docs/certificate.md."""
