"""Record a run to a rerun file, read it back, compare two. Nothing here loads rerun before it is used."""
