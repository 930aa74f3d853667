"""The page in the browser: templates, style, script, the messages between browser and Python, the server."""

LOCAL = ("127.0.0.1", "localhost", "::1")  # names of this machine that only this machine can reach
