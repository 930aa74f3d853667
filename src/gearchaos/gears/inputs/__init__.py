"""Reading of inputs: one value or two, tables in text files, and refusal of implausible values."""
