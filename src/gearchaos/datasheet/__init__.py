"""The datasheet of a gear design: the answer that comes first, and the page of HTML with all quantities and curves."""
