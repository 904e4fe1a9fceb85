# SPDX-License-Identifier: MIT
"""What of openmmpse is public, and so belongs into the reference."""

import importlib
import pkgutil

import openmmpse


def publicModules():
    """{name: module} of openmmpse and what lies beneath it, as far as `__all__` says what is public."""
    modules = {"openmmpse": openmmpse}
    for entry in pkgutil.iter_modules(openmmpse.__path__, "openmmpse."):
        if not entry.name.endswith((".__main__", ".binding")):
            module = importlib.import_module(entry.name)
            if hasattr(module, "__all__"):
                modules[entry.name] = module
    return modules


def publicNames():
    """Full names of everything public: members of modules, and of classes all that is documented there."""
    names = set()
    for moduleName, module in publicModules().items():
        names.update(f"{moduleName}.{name}" for name in module.__all__)
    integrator = openmmpse.PSEBrownianIntegrator
    names.update(
        f"openmmpse.{integrator.__name__}.{name}"
        for name in vars(integrator)
        if not name.startswith("_") and name != "thisown"
    )
    return names
