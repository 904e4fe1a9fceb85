# SPDX-License-Identifier: MIT
"""Trajectories read with MDTraj or MDAnalysis, as arrays in nm and ps, and unwrapped; docs/analysis.md [A5]."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

ANGSTROM = 0.1  #: nm
LONGEST_STEP = 0.4  #: of the shortest lattice vector; beyond a half, no image is right for sure
CHUNK = 2**20  #: vectors whose images are compared at a time
NEIGHBOURS = np.array(list(itertools.product((-1, 0, 1), repeat=3)))


class Trajectory(NamedTuple):
    """Frames of particles."""

    positions: np.ndarray  #: (frames, N, 3), nm
    times: np.ndarray | None  #: (frames,), ps
    boxes: np.ndarray | None  #: (frames, 3, 3), rows are the vectors, nm

    @property
    def interval(self):
        """Time between frames, ps."""
        if self.times is None:
            raise ValueError("this trajectory has no times: give the time between frames yourself")
        steps = np.diff(self.times)
        if not np.allclose(steps, steps.mean(), rtol=1e-3):
            raise ValueError(f"frames are not evenly spaced: {steps.min():g} to {steps.max():g} ps apart")
        return float(steps.mean())


def readTrajectory(source, unwrapped=True):
    """Frames that other libraries read, in nm and ps.

    Libraries are not imported here; what counts is the attributes. Files of OpenMM's DCDReporter and XTCReporter:
    write them with enforcePeriodicBox=False, and nothing has to be unwrapped. MDTraj gives frames of DCD files their
    numbers for times: give `diffusion` the interval yourself there.

    Parameters
    ----------
    source : mdtraj.Trajectory, MDAnalysis Universe or AtomGroup, or array (frames, N, 3)
        an array is in nm, without times and boxes
    unwrapped : bool
        take jumps across faces of the box back, where there is a box (`unwrap`)

    Returns
    -------
    Trajectory
        positions, times and boxes
    """
    if hasattr(source, "xyz") and hasattr(source, "unitcell_vectors"):
        boxes = source.unitcell_vectors
        found = Trajectory(_array(source.xyz), _array(source.time), None if boxes is None else _array(boxes))
    elif hasattr(source, "trajectory"):
        found = _frames(getattr(source, "atoms", source), source.trajectory)
    elif hasattr(source, "universe"):
        found = _frames(source, source.universe.trajectory)
    else:
        found = Trajectory(_array(source), None, None)
    if found.positions.ndim != 3 or found.positions.shape[2] != 3:
        raise ValueError(f"expected positions of shape (frames, N, 3), got {found.positions.shape}")
    if unwrapped and found.boxes is not None:
        found = found._replace(positions=unwrap(found.positions, found.boxes))
    return found


def unwrap(positions, boxes):
    """Take jumps across faces of the box back [A5].

    Each step is replaced by its shortest image in the box of its frame, tilted boxes included, and steps are added up.
    That is exact as long as no particle moves by half the shortest lattice vector between frames. In a box that
    changes, this way of adding up keeps diffusion right, where adding lattice vectors to positions does not. For shear
    flow let OpenMM write unwrapped positions instead (enforcePeriodicBox=False): there images move relative to each
    other.

    Parameters
    ----------
    positions : array (frames, N, 3)
        nm, each in whatever image
    boxes : array (3, 3) or (frames, 3, 3)
        rows are the vectors in OpenMM's reduced form, nm

    Returns
    -------
    array (frames, N, 3)
        nm; the first frame as it was

    Raises
    ------
    ValueError
        if a step comes to two fifths of the shortest lattice vector: frames are too far apart to tell images
    """
    positions = np.asarray(positions, dtype=float)
    boxes = np.broadcast_to(np.asarray(boxes, dtype=float), (len(positions), 3, 3))
    out = np.empty_like(positions)
    out[0] = positions[0]
    stride = max(1, CHUNK // positions.shape[1])
    for begin in range(1, len(positions), stride):
        end = min(begin + stride, len(positions))
        steps = nearestImages(positions[begin:end] - positions[begin - 1 : end - 1], boxes[begin:end])
        limit = LONGEST_STEP * shortestVectors(boxes[begin:end])
        far = np.sqrt(np.square(steps).sum(axis=-1)) - limit[:, None]
        if far.max() > 0:
            frame, particle = np.unravel_index(np.argmax(far), far.shape)
            raise ValueError(
                f"particle {particle} moves by {np.linalg.norm(steps[frame, particle]):.3g} nm or an image of that "
                f"before frame {begin + frame}, more than {limit[frame]:.3g} nm, two fifths of the shortest box vector: which "
                "image it is cannot be told; write frames more often, or with enforcePeriodicBox=False, and do not "
                "unwrap"
            )
        out[begin:end] = out[begin - 1] + np.cumsum(steps, axis=0)
    return out


def nearestImages(vectors, boxes):
    """Shortest images of vectors (frames, N, 3) in boxes (frames, 3, 3) in reduced form, as OpenMM's are."""
    fractions = vectors @ np.linalg.inv(boxes)
    near = (fractions - np.rint(fractions)) @ boxes
    if not np.any(boxes * (1 - np.eye(3))):
        return near
    best, shortest = near, np.square(near).sum(axis=-1)
    for shift in NEIGHBOURS:
        trial = near + (shift @ boxes)[:, None]
        length = np.square(trial).sum(axis=-1)
        closer = length < shortest
        best = np.where(closer[..., None], trial, best)
        shortest = np.where(closer, length, shortest)
    return best


def shortestVectors(boxes):
    """Length of the shortest lattice vector of each box (frames, 3, 3) in reduced form."""
    others = NEIGHBOURS[np.any(NEIGHBOURS != 0, axis=1)]
    return np.sqrt(np.square(others @ boxes).sum(axis=-1).min(axis=-1))


def _frames(atoms, frames):
    """`Trajectory` of an MDAnalysis AtomGroup."""
    positions, times, boxes = [], [], []
    for frame in frames:
        positions.append(np.array(atoms.positions, dtype=float) * ANGSTROM)
        times.append(frame.time)
        vectors = frame.triclinic_dimensions
        boxes.append(None if vectors is None else np.array(vectors, dtype=float) * ANGSTROM)
    known = all(box is not None for box in boxes)
    return Trajectory(np.array(positions), np.array(times, dtype=float), np.array(boxes) if known else None)


def _array(values):
    return np.asarray(getattr(values, "_value", values), dtype=float)
