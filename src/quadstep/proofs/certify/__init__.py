"""`quadstep certify`: what Theorem 5.1 requires and promises, measured on one flight. See docs/certificate.md."""
