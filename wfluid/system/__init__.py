"""The operating system: atomic files, memory, threads, interrupts, stderr."""
