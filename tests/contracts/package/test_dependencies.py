"""Interfaces of Numba and Bokeh outside their public, versioned API: each one that the sources use must exist.

Both packages may change these in any minor version, so pyproject.toml excludes the first minor version that has not
been tested. To allow a newer one: install it, run the tests, adapt the files that a failure names, and raise the upper
bound in pyproject.toml.
"""

import ast
import inspect
import re
import tomllib
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest

import gearchaos
from tests import ROOT

SOURCES = Path(gearchaos.__file__).parent

PRIVATE = {
    "numba": {
        "numba.core.config": ("CACHE_DIR", "DISABLE_JIT"), "numba.core.event": ("Listener", "Event", "register"),
        "numba.core.caching": ("FunctionCache", "FunctionCache._load_overload", "FunctionCache._save_overload",
                               "CacheImpl.filename_base"),
        "numba.core.dispatcher": ("Dispatcher.enable_caching", "Dispatcher.stats"),
        "numba.core.base": ("BaseContext.make_array", "BaseContext.get_constant", "BaseContext.get_dummy_value"),
        "numba.core.cgutils": ("get_or_insert_function",),
        "numba.core.codegen": ("JITCodeLibrary._optimize_functions", "JITCodeLibrary._optimize_final_module",
                               "JITCodeLibrary._finalize_final_module"),
        "numba.core.compiler": ("Compiler", "Compiler.define_pipelines", "CompilerBase.__init__"),
        "numba.core.registry": ("cpu_target.target_context.refresh",), "numba.core.types": ("Function", "Type"),
        "numba.core.typing": ("signature",), "numba.core.typing.templates": ("ConcreteTemplate", "infer_global"),
        "numba.extending": ("intrinsic", "overload", "lower_builtin", "register_model", "models.PrimitiveModel"),
    },
    "bokeh": {
        "bokeh.application.handlers": ("FunctionHandler.on_server_unloaded",), "bokeh.core.templates": ("get_env",),
        "bokeh.document": ("document.gc",), "bokeh.document.models": ("DocumentModelManager.freeze",),
        "bokeh.protocol": ("Protocol.assemble",),
        "bokeh.protocol.message": ("Message",),
        "bokeh.server.connection": ("ServerConnection.error", "ServerConnection.protocol"),
        "bokeh.server.server": ("BaseServer",), "bokeh.server.session": ("ServerSession.pull", "ServerSession.patch"),
        "bokeh.server.tornado": ("BokehTornado.get_handler_delegate", "BokehTornado._cleanup_sessions"),
        "bokeh.server.util": ("bind_sockets",),
        "bokeh.server.views.doc_handler": ("DocHandler",), "bokeh.server.views.ico_handler": ("IcoHandler",),
        "bokeh.server.views.static_handler": ("StaticHandler",),
        "bokeh.server.views.ws": ("WSHandler.open", "WSHandler.on_message", "WSHandler.check_origin",
                                  "WSHandler.send_message"),
    },
}
"""Package -> module -> attributes that the sources import, call, override or assign."""

PARAMETERS = {
    "numba.core.caching FunctionCache._save_overload": ("self", "sig", "data"),
    "bokeh.server.server BaseServer.__init__": ("self", "io_loop", "tornado_app", "http_server"),
    "bokeh.server.session ServerSession.patch": ("message", "connection"),
    "bokeh.server.views.ws WSHandler.on_message": ("self", "fragment"),
    "bokeh.protocol Protocol.assemble": ("self", "header_json", "metadata_json", "content_json"),
}
"""First parameters of functions that are overridden, or called by position."""

TORNADO_OPTIONS = (
    "websocket_max_message_size_bytes", "sign_sessions", "secret_key", "check_unused_sessions_milliseconds",
    "unused_session_lifetime_milliseconds",
)

PUBLIC = re.compile(r"numba(\.extending)?|bokeh\.(models|events|plotting|palettes|application|application\.handlers)")
"""Modules whose names are part of the documented API of the packages."""

def advice(package: str, module: str) -> str:
    found = [str(f.relative_to(SOURCES)) for f in sorted(SOURCES.rglob("*.py")) if module in f.read_text()]
    files = ", ".join(found) or f"the users of {package}"
    return f"adapt {files} and this table, then raise the upper bound of {package} in pyproject.toml"


def attribute(path: str, owner: object) -> object:
    for name in path.split("."):
        owner = getattr(owner, name)
    return owner


@pytest.mark.parametrize(("package", "module", "name"), [
    (package, module, name) for package, of in PRIVATE.items() for module, names in of.items() for name in names])
def test_a_private_interface_exists(package, module, name):
    try:
        attribute(name, import_module(module))
    except (ImportError, AttributeError) as error:
        pytest.fail(f"{package} {version(package)} has no {module}.{name} ({error}): {advice(package, module)}")


@pytest.mark.parametrize("place", PARAMETERS)
def test_a_private_function_has_these_first_parameters(place):
    module, name = place.split()
    found = tuple(inspect.signature(attribute(name, import_module(module))).parameters)
    package, expected = module.split(".")[0], PARAMETERS[place]
    assert found[: len(expected)] == expected, (
        f"{package} {version(package)}: {name}{found} instead of {expected}: {advice(package, module)}")


def test_the_server_of_bokeh_has_these_options():
    from bokeh.server.tornado import BokehTornado

    missing = set(TORNADO_OPTIONS) - set(inspect.signature(BokehTornado.__init__).parameters)
    assert not missing, f"bokeh {version('bokeh')} lacks {missing}: {advice('bokeh', 'bokeh.server.tornado')}"


def test_a_compiled_function_has_a_replaceable_cache_and_no_reference_counting():
    from numba import njit

    compiled = njit(nogil=True, error_model="numpy", _nrt=False)(lambda x: x)
    assert hasattr(compiled, "_cache"), f"numba {version('numba')}: {advice('numba', 'numba.core.caching')}"


def test_the_browser_s_half_of_bokeh_has_what_the_page_replaces():
    """Without these the page still works, but takes three times as long to draw."""
    page = next(SOURCES.rglob("page.js")).read_text()
    modules = re.findall(r'^  "([a-z_/]+)":', page, re.MULTILINE)
    names = re.findall(r'(?:prototype\.|prototype, ")(\w+)', page)
    script = Path(find_spec("bokeh").origin).parent / "server" / "static" / "js" / "bokeh.js"
    text = script.read_text(encoding="utf-8")
    assert len(modules) == 5 and len(names) >= 6
    missing = [name for name in (*modules, *names) if name not in text]
    assert not missing, f"BokehJS {version('bokeh')} lacks {missing}: adapt page.js of the explorer"


def test_every_private_module_that_is_imported_is_listed():
    texts = [text for file in SOURCES.rglob("*.py") if re.search("numba|bokeh", text := file.read_text())]
    imported = {name for text in texts for name in imports(text) if re.match("numba|bokeh", name)}
    private = {name for name in imported if not PUBLIC.fullmatch(name)}
    assert {"numba.core.caching", "bokeh.server.session"} <= private
    assert private <= {module for modules in PRIVATE.values() for module in modules}, "list what they are used for"


def imports(text: str) -> set[str]:
    """The modules that a source imports from; ``from package.core import module`` counts as that module."""
    found = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.ImportFrom) and n.module]
    deep = {f"{n.module}.{a.name}" for n in found for a in n.names if n.module.endswith(".core")}
    return deep | {n.module for n in found if not n.module.endswith(".core")}


@pytest.mark.parametrize("package", PRIVATE)
def test_untested_minor_versions_are_excluded(package):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    requirements = [*project["dependencies"], *project["optional-dependencies"]["app"]]
    bound = next(re.fullmatch(rf"{package}>=[\d.]+,<(\d+)\.(\d+)", r) for r in requirements if r.startswith(package))
    assert bound, f"{package} needs an upper bound: its next minor version may change what is listed here"
    tested = re.search(rf"^{package}==(\d+)\.(\d+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert (int(bound[1]), int(bound[2])) == (int(tested[1]), int(tested[2]) + 1), "the bound follows constraints.txt"
