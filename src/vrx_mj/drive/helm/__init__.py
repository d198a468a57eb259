"""A person at the helm: keys, what they ask of a boat, and its engines. Light: no simulation is imported."""
