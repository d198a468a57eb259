"""Array kernels: one module per effect, plain numbers in, wrenches out."""
