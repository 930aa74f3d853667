"""End-to-end tests of real processes: the explorer in a browser, killed runs, full disks, fuzzing. All marked slow."""
