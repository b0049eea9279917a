"""ANCF plates with grooves by subdomain integration (He, Patel, Shabana). NumPy and SciPy only."""
