"""Keys and viewers."""
