"""The import contracts hold for every file: the graph that they are checked on leaves none out."""

from __future__ import annotations

from graphlib import TopologicalSorter
from pathlib import Path

import grimp

import pilotage

PACKAGE = Path(pilotage.__file__).parent


def test_every_folder_with_code_is_a_package() -> None:
    """Without ``__init__.py`` the import graph passes a folder over in silence."""
    folders = {path.parent for path in PACKAGE.rglob("*.py")}
    parents = {above for folder in folders for above in (folder, *folder.parents) if PACKAGE in above.parents}
    missing = sorted(
        str(folder.relative_to(PACKAGE)) for folder in parents if not (folder / "__init__.py").is_file()
    )
    assert missing == []


def test_the_import_graph_sees_every_file() -> None:
    graph = grimp.build_graph("pilotage", cache_dir=None)
    files = {
        ".".join(("pilotage", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
        for path in PACKAGE.rglob("*.py")
    }
    assert files - graph.modules == set()
    assert graph.modules - files == set()


def test_no_file_imports_itself_through_others() -> None:
    """Nor for its types alone; the package's face, which all of it may name, is not asked."""
    graph = grimp.build_graph("pilotage", cache_dir=None)
    below = {m: graph.find_modules_directly_imported_by(m) - {"pilotage"} for m in graph.modules}
    TopologicalSorter(below).prepare()  # names the circle in its error
