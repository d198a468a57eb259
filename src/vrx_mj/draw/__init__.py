"""Pictures: maps, charts, compliance; notebooks."""
