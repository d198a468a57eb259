"""What boats measure: from a moment of the world to readings. The runtime decides when."""
