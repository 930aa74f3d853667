"""One figure of the page per file."""
