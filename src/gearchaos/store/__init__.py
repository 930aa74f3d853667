"""Durable runs: a study computed tile by tile into a store, from which it goes on when it was stopped.

From the bottom up: ``objects`` (files on disk or in an object store, by zarr), ``tiles`` (how the work is divided),
``record`` (the study on disk), ``store`` (layout, metadata), ``blocks`` (what workers write), ``lock``, ``check`` (what
is missing or damaged), ``read`` and ``run``. `gearchaos.run` is `run.run`, and `gearchaos.load` is `read.load`.
"""
