# SPDX-License-Identifier: MIT
"""Brownian dynamics with hydrodynamic interactions for OpenMM, by Positively Split Ewald.

PSEBrownianIntegrator takes the place of openmm.BrownianIntegrator: see its documentation.
`python -m openmmpse doctor` checks an installation, `python -m openmmpse demo` shows what it does, and
`python -m openmmpse accuracy` (in Python: accuracy.measure) tells what accuracy costs for a scene of one's own.
`openmmpse.analysis` makes diffusion and viscosity of trajectories, with error bars.
HydrodynamicsReporter writes how the fluid fares in a Simulation, and `python -m openmmpse plot` draws it.
"""

from importlib.metadata import version as _version

import openmm as _openmm

__version__ = _version("openmm-pse")

if not _openmm.Platform.getOpenMMVersion().startswith("8.6."):
    raise ImportError(
        f"openmmpse {__version__} is built for OpenMM 8.6, but OpenMM "
        f"{_openmm.Platform.getOpenMMVersion()} is installed; "
        "install the one it needs with: pip install 'openmm>=8.6.1,<8.7'"
    )

from openmmpse.binding import PSEBrownianIntegrator
from openmmpse.plugins import loadMissing as _loadMissing

PSEBrownianIntegrator.__module__ = __name__
_loadMissing()

from openmmpse import accuracy as accuracy  # noqa: E402  (needs the integrator above)
from openmmpse import analysis as analysis  # noqa: E402
from openmmpse.reporter import HydrodynamicsReporter as HydrodynamicsReporter  # noqa: E402

HydrodynamicsReporter.__module__ = __name__

__all__ = ["HydrodynamicsReporter", "PSEBrownianIntegrator"]
