"""Users' files: YAML and dock drawings as frozen, checked models."""
