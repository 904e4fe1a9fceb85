# SPDX-License-Identifier: MIT
"""Diffusion, viscosity and what belongs to them, from trajectories, with error bars: docs/analysis.md.

    frames = analysis.readTrajectory(mdtraj.load("run.dcd", top="run.pdb"))
    centres = analysis.centresOf(frames.positions, molecules=20)
    fit = analysis.diffusion(centres, frames.interval, start=500.0)
    box = frames.boxes[0]
    print(fit.coefficient.shifted(analysis.finiteSizeCorrection(box, viscosity, kT, radius, gyration)))

Arrays of positions have the shape (frames, N, 3); several independent runs are a list of them. Numbers are in OpenMM's
units (nm, ps, kJ/mol, Da/(nm ps)), diffusion coefficients in nm^2/ps, of which 1 is 1e-6 m^2/s.
"""

from .beads import (
    M2_PER_S,
    MPA_S,
    freeDraining,
    frozenBound,
    gaussianChainKirkwood,
    kirkwood,
    mobilityMatrix,
    radiusOfGyration,
    rigidBody,
    stokesMobility,
    thermalEnergy,
)
from .boxes import finiteSizeCorrection, latticeConstant, shortTimeDiffusion
from .displacements import Diffusion, centresOf, diffusion, meanSquareDisplacement, spacedLags
from .estimates import Curve, Estimate, blocksOf, estimate, meanOfBlocks
from .stresses import GreenKubo, greenKubo
from .trajectory import Trajectory, readTrajectory, unwrap

__all__ = [
    "Curve", "Diffusion", "Estimate", "GreenKubo", "M2_PER_S", "MPA_S", "Trajectory", "blocksOf", "centresOf",
    "diffusion", "estimate", "finiteSizeCorrection", "freeDraining", "frozenBound", "gaussianChainKirkwood",
    "greenKubo", "kirkwood", "latticeConstant", "meanOfBlocks", "meanSquareDisplacement", "mobilityMatrix",
    "radiusOfGyration", "readTrajectory", "rigidBody", "shortTimeDiffusion", "spacedLags", "stokesMobility",
    "thermalEnergy", "unwrap",
]  # fmt: skip
