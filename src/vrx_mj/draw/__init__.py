"""Pictures of worlds and boats by matplotlib: maps, and what rules say of a boat's parts."""
