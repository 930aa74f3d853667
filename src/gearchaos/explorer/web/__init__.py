"""The page in the browser: templates, style, script, the messages between browser and Python, the server."""

from secrets import token_urlsafe

LOCAL = ("127.0.0.1", "localhost", "::1")  # names of this machine that only this machine can reach

START = "start"  # the path of the page that offers a choice of what to open

KEY = token_urlsafe()
"""Names this process in the address of a page in a notebook, which is another site: no other page can know it."""
