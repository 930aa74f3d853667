"""The explorer: a map of motions in the browser, and for any point of it the motion behind it.

======== ==========================================================================================
view     the state of a page: model, map, point; its address; presets; bounds
jobs     what is computed for it and in which order; threads, worker processes, cancelling
panels   one figure per file, and the texts beside the figures
web      templates, style and script of the page; messages, controls, events; server and its guard
======== ==========================================================================================
"""
