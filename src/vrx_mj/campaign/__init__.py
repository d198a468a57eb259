"""Campaigns: controllers on worlds with seeds, in parallel, with a page that shows and compares the scores."""
