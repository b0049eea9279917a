"""Adapters to codes nobody here wrote. Each is optional: `available()` says whether it is installed."""
