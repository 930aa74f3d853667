"""The explorer: a map of motions in the browser, and for any point of the map the motion there.

======== ==========================================================================================
core     the state of a page: model, map, point; its address; presets; bounds; threads, worker processes, cancelling
features what a page shows, a room for each: what is computed, its figures, the text beside them
web      what is computed in which order; style and script of the page; messages, its session; the server and its checks
======== ==========================================================================================
"""
