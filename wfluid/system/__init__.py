"""What the machine gives: files that appear whole, memory, threads, interrupts."""
