"""Pictures of worlds and boats by matplotlib: maps, and verdicts on a boat's parts."""
