"""How a function of one cell becomes a kernel: precision, layout, programs, strips."""
