"""Other people's programs that compute what our files have: one module for each."""
