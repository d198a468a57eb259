"""A compiled world as frozen dataclasses with units, and its form in JSON."""
