"""From YAML models to MJCF."""
