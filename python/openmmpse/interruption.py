# SPDX-License-Identifier: MIT
"""Calls that spend long in C++: Ctrl-C is heard between two steps, and the Context outlives them."""

import contextlib
import gc
import signal
import threading
import time
import weakref

import openmm

BLOCK_SECONDS = 0.2  # between two looks at signals
GROWTH = 32  # of the number of steps from a block to the next


class DeferredInterrupt:
    """
    While it is entered, SIGINT waits: raised in the midst of a Force that is a Python function, a
    KeyboardInterrupt would be that Force's failure. deliver() and the exit give it to the handler
    that was there; a second one does not wait. Only the main thread handles signals.
    """

    def __enter__(self):
        self.handler, self.noted = None, []
        handler = signal.getsignal(signal.SIGINT)
        if callable(handler) and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, self.note)
            self.handler = handler
        return self

    @property
    def isActive(self):
        return self.handler is not None

    def note(self, number, frame):
        self.noted.append((number, frame))
        if len(self.noted) > 1:
            self.handler(number, frame)

    def deliver(self):
        if self.noted:
            last = self.noted[-1]
            self.noted.clear()
            self.handler(*last)

    def __exit__(self, *failure):
        if self.isActive:
            signal.signal(signal.SIGINT, self.handler)
            self.deliver()


def inBlocks(call, count):
    """call(n) with n that add up to count, so that SIGINT is heard every BLOCK_SECONDS."""
    with DeferredInterrupt() as interrupt:
        block = 1 if interrupt.isActive else count
        while count > block:
            start = time.perf_counter()
            call(block)
            interrupt.deliver()
            count -= block
            perSecond = block / max(time.perf_counter() - start, 1e-9)
            block = max(1, min(int(BLOCK_SECONDS * perSecond), GROWTH * block))
        call(count)


def keptContext(integrator):
    """
    The openmm.Context of an integrator, for as long as a call on it lasts: C++ would go on in a
    deleted one. None if it has none, or if it is not owned by Python.
    """
    address = integrator._contextAddress()
    known, reference = getattr(integrator, "_knownContext", (0, None))
    if known != address or (reference is not None and reference() is None):
        # an integrator does not know its Context in Python: once for each, all objects are asked
        found = [one for one in gc.get_objects()
                 if type(one) is openmm.Context and hasattr(one, "this") and int(one.this) == address]
        reference = weakref.ref(found[0]) if found else None
        integrator._knownContext = (address, reference)
    return reference() if reference is not None else None


@contextlib.contextmanager
def refusedWithText():
    """OpenMM passes on the text of a Python exception in a Force, which may be empty."""
    try:
        yield
    except openmm.OpenMMException as failure:
        if str(failure).strip() in ("", "<NULL>"):
            raise openmm.OpenMMException(
                "PSEBrownianIntegrator: a Force raised an exception without a text (KeyboardInterrupt or "
                "SystemExit in the function of a PythonForce, say), and that step is not made; give the "
                "exception a text, or call the function alone to see which one it is") from failure
        raise
