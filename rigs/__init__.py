"""Machines: profiles, jobs, G-code, the driver, replay, journal and the emulator.

The names below are the public API; their modules load when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.lazy_package import lazy_names

if TYPE_CHECKING:
    from rigs.emulator import start_emulator as start_emulator
    from rigs.errors import JobError as JobError
    from rigs.errors import MachineError as MachineError
    from rigs.errors import ProfileError as ProfileError
    from rigs.errors import RigError as RigError
    from rigs.errors import UnknownNameError as UnknownNameError
    from rigs.gcode import write_gcode as write_gcode
    from rigs.job import Block as Block
    from rigs.job import Job as Job
    from rigs.job_build import make_job as make_job
    from rigs.job_file import read_job as read_job
    from rigs.job_file import write_job as write_job
    from rigs.journal import Journal as Journal
    from rigs.journal import read_journal as read_journal
    from rigs.limits import machine_limits as machine_limits
    from rigs.material import Material as Material
    from rigs.material import load_material as load_material
    from rigs.material import material_names as material_names
    from rigs.material import parse_material as parse_material
    from rigs.probe import probe as probe
    from rigs.process import CutProcess as CutProcess
    from rigs.process import FoldProcess as FoldProcess
    from rigs.process import Process as Process
    from rigs.replay import Progress as Progress
    from rigs.replay import replay as replay
    from rigs.replay_checks import Certificate as Certificate
    from rigs.rig import Rig as Rig
    from rigs.rig import load_rig as load_rig
    from rigs.rig import parse_rig as parse_rig
    from rigs.rig import rig_names as rig_names

_MODULES = {
    "Block": "rigs.job",
    "Certificate": "rigs.replay_checks",
    "CutProcess": "rigs.process",
    "FoldProcess": "rigs.process",
    "Job": "rigs.job",
    "JobError": "rigs.errors",
    "Journal": "rigs.journal",
    "MachineError": "rigs.errors",
    "Material": "rigs.material",
    "Process": "rigs.process",
    "ProfileError": "rigs.errors",
    "Progress": "rigs.replay",
    "Rig": "rigs.rig",
    "RigError": "rigs.errors",
    "UnknownNameError": "rigs.errors",
    "load_material": "rigs.material",
    "load_rig": "rigs.rig",
    "machine_limits": "rigs.limits",
    "make_job": "rigs.job_build",
    "material_names": "rigs.material",
    "parse_material": "rigs.material",
    "parse_rig": "rigs.rig",
    "probe": "rigs.probe",
    "read_job": "rigs.job_file",
    "read_journal": "rigs.journal",
    "replay": "rigs.replay",
    "rig_names": "rigs.rig",
    "start_emulator": "rigs.emulator",
    "write_gcode": "rigs.gcode",
    "write_job": "rigs.job_file",
}

__all__ = sorted(_MODULES)

__getattr__ = lazy_names(__name__, _MODULES)
