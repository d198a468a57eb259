"""Comparisons of the physics with closed forms, other programs and tanks, and the report of them."""
