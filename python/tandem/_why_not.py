"""Why the package's C++ half cannot be imported. Needs nothing but Python."""

import importlib.machinery
import pathlib
import sys


def why_not(error: ImportError) -> str:
    """In words that say what to do; `error` is what Python says."""
    folder = pathlib.Path(__file__).parent
    built = sorted(one.name for one in folder.glob("_native*.so"))
    if not built:
        return (
            f"tandem was not built: no _native*.so in {folder} (in Tandem's folder: "
            "scripts/install-dependencies python; cmake --preset demo; "
            "cmake --build --preset demo --target tandem_python: docs/python.md)"
        )
    fits = {"_native" + suffix for suffix in importlib.machinery.EXTENSION_SUFFIXES}
    if fits.isdisjoint(built):
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        return (
            f"tandem was built for another Python: {', '.join(built)} in {folder}, and this is "
            f"Python {version}, {sys.executable} (start the one that Tandem was built with: "
            "docs/python.md)"
        )
    return f"{error} (docs/python.md says what tandem needs)"
