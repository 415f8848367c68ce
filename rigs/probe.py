"""Looking at a machine without moving it: who it is, and where it differs from its profile."""

from __future__ import annotations

from dataclasses import dataclass

from rigs.controller import Controller
from rigs.grbl import Status
from rigs.identity import Identity
from rigs.link import open_link
from rigs.marlin import spoken
from rigs.replay_checks import identity_mistakes
from rigs.rig import Rig

__all__ = ["Probe", "probe"]


@dataclass(frozen=True)
class Probe:
    """What a look at a machine found.

    Attributes:
        identity: what the controller says about itself.
        status: its state and position.
        mistakes: differences from the profile, in words; empty when a job may be armed.
    """

    identity: Identity
    status: Status
    mistakes: tuple[str, ...]


def probe(url: str, rig: Rig) -> Probe:
    """Ask a machine who it is; nothing but questions is sent.

    Raises:
        MachineError: if the port does not open or nothing answers.
    """
    link = open_link(url, rig)
    try:
        controller = Controller(spoken(link, rig), rig)
        status = controller.hello()
        identity = controller.identify()
    finally:
        link.close()
    return Probe(identity, status, tuple(identity_mistakes(identity, rig)))
