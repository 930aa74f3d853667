"""The datasheet of a gear design as a page of HTML: all quantities, with a drawing of the pair and its curves."""

from gearchaos.datasheet.page import sheet_html

__all__ = ["sheet_html"]
