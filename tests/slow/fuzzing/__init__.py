"""Fuzzing of the command line: random commands and files, run in a process that may hang, crash or exhaust memory."""
