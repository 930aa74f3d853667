"""Fixtures that several folders share, and which process runs which tests."""

import gc
import re
import signal
import sys
from collections import Counter

import pytest

TOGETHER = {
    "the explorer in a browser": r"tests/slow/test_explorer(?!_trains)",
    "runs of processes": r"tests/slow/test_(runs|power_failure|object_stores|full_disk)",
    "a chaotic set": r"tests/(oracles/test_segment|contracts/proof/test_chaos_proof)",
}
"""Files whose tests one process runs, since they share a server or what takes long to compute, those that take longest
first: what comes last should be short, so that the processes end together."""

APART = (r"tests/(pinned/test_(docs|doctests)|oracles/test_(damping_laws|physical_trains)|"
         r"contracts/package/test_cache)")
"""Files whose tests share nothing, so that any process may run each of them."""


gc.disable()  # while tests are collected: of what is made then, nothing is garbage


def pytest_collection_finish():
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from xdist.scheduler import LoadFileScheduling

    class Units(LoadFileScheduling):
        """Each process gets the next group, file or test that has not begun, the long ones first."""

        def _split_scope(self, nodeid):
            file = nodeid.split("::")[0]
            group = next((name for name, files in TOGETHER.items() if re.match(files, file)), file)
            return nodeid if re.match(APART, file) else group

    config.option.loadscopereorder = False  # by the number of tests
    return Units(config, log) if config.option.dist == "loadfile" else None


def pytest_addoption(parser):
    parser.addoption("--within", type=float, metavar="SECONDS",
                     help="only tests that took so long together when they ran last, those of each function in turn")
    parser.addoption("--reached", metavar="COMMIT",
                     help="only the test files that import what differs from this commit, directly or through others")


@pytest.hookimpl(trylast=True)  # after those that -m leaves out
def pytest_collection_modifyitems(config, items):
    """The files that take longest first; with --reached and --within, the nearest and quickest tests alone."""
    order = [*TOGETHER.values(), APART, "tests/slow", ""]
    items.sort(key=lambda item: next(i for i, files in enumerate(order) if re.match(files, item.nodeid)))
    since, left = config.getoption("reached"), config.getoption("within")
    if since is None and left is None:
        return
    steps = _steps(since) if since else {}
    seconds, cases, turns, chosen = _seconds_of(config), Counter(), [], set()
    for item in items:
        if (near := steps.get(_file(item)) if steps else 0) is not None:
            cases[function := item.nodeid.split("[")[0]] += 1
            turns.append((near, cases[function], seconds.get(item.nodeid, _UNKNOWN), item.nodeid))
    for *_, duration, name in sorted(turns):
        if left is None or duration <= left:
            left = None if left is None else left - duration
            chosen.add(name)
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in chosen])
    if since:
        config.stash[_SAID] = _in_words(items, {name for *_, name in turns}, chosen, bool(steps))
    items[:] = [item for item in items if item.nodeid in chosen]


_SAID = pytest.StashKey[str]()
"""What is run and what is left out, in words."""


def _file(item):
    return item.nodeid.split("::")[0]


def _steps(since):
    """How many imports lead from each test file to what differs from a commit; nothing if that reaches none."""
    from tests.reach import changed_files, distances

    return distances(changed_files(since))


def _in_words(items, reached, chosen, some):
    if not some:
        return f"the change reaches no test; instead of them {len(chosen)} of all {len(items)}"
    files = {name: {_file(item) for item in items if item.nodeid in group} for name, group in (
        ("reached", reached), ("chosen", chosen))}
    out = [f"{len(chosen)} tests of {len(files['chosen'])} files; the change reaches {len(reached)} of "
           f"{len(files['reached'])}, of {len(items)} in all"]
    if missing := Counter(name.rpartition("/")[0] for name in files["reached"] - files["chosen"]):
        out.append("reached, but for want of time without a test: files of " + ", ".join(
            f"{folder} {count}" for folder, count in sorted(missing.items())))
    return "\n".join(out)


def pytest_sessionfinish(session):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["said"] = session.config.stash.get(_SAID, "")


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    node.config.stash[_SAID] = getattr(node, "workeroutput", {}).get("said", "")


def pytest_terminal_summary(terminalreporter, config):
    if said := config.stash.get(_SAID, ""):
        terminalreporter.write_line(said)


_SECONDS, _UNKNOWN = "gearchaos/seconds", 0.1
"""Where pytest's cache holds how long each test took, and what one takes that has not been run."""


def _seconds_of(config):
    return config.cache.get(_SECONDS, {}) if hasattr(config, "cache") else {}


class _Clock:
    """Keeps how long each test takes for the next run --within a time."""

    def __init__(self):
        self.taken = Counter()

    def pytest_runtest_logreport(self, report):
        self.taken[report.nodeid] += report.duration

    def pytest_sessionfinish(self, session):
        session.config.cache.set(_SECONDS, _seconds_of(session.config) | self.taken)


def pytest_configure(config):
    if hasattr(config, "cache") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Clock())


@pytest.fixture(autouse=True)
def figures_closed():
    """No test leaves figures to the next ones: pyplot keeps them, and warns of more than 20."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def small(monkeypatch):
    """A view of the explorer with few cells, all of them 1T."""
    from dataclasses import replace

    import gearchaos as gc
    from gearchaos.explorer.core import models
    from gearchaos.explorer.core.presets import presets

    monkeypatch.setattr(models, "MAP_CELLS", (56, 40))
    x, y = gc.Axis("omega", 0.9, 1.1, 56), gc.Axis("eps1", 0.0, 0.02, 40)
    return replace(presets()["2"].view, x=x, y=y, at=(1.0, 0.01))


@pytest.fixture
def no_waiting():
    """A time limit of 20 seconds, for tests whose subject would wait without end if it were wrong."""
    def end(*_):
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
