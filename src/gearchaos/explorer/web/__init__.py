"""The page in the browser: templates, style, script, the messages between browser and Python, the server."""
