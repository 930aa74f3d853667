"""The explorer: a map of motions in the browser, and for any point of the map the motion there.

======== ==========================================================================================
view     the state of a page: model, map, point; its address; presets; bounds
jobs     what is computed for a page, in which order; threads, worker processes, cancelling
panels   the figures, and the texts beside them
web      templates, style and script of the page; messages, the session of a page; the server and its checks
======== ==========================================================================================
"""
