"""Durable runs: a study computed tile by tile into a store, from which it goes on when it was stopped.

From the bottom up: ``files`` (the files of a store, on disk or in an object store), ``tiles`` (how the work is
divided), ``journals`` (what is done), ``writers`` (who writes), ``layout`` (how results lie in files), ``schema`` and
``record`` (the study on disk), ``store`` (a store that can be read), ``reading`` and ``running``. `gearchaos.run` is
`running.run.run`, and `gearchaos.load` is `reading.load.load`.
"""
