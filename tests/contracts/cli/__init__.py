"""Commands and study files: what they print, answer in JSON, write and refuse."""
