"""For all rooms: errors, units, tables of numbers, ranks, progress, signals, set-ups on disk, and the stack below."""
