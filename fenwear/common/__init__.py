"""Shared by all rooms: errors, units, tables of numbers, ranks, progress, signals, set-ups on disk, the stack below."""
