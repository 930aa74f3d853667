"""Writes the results of the oracles when it is asked to."""

from tests.oracles import stored


def pytest_sessionfinish():
    for file in stored.FILES.values() if stored.MODE == "write" else ():
        file.write()
