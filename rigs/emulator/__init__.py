"""An emulated GRBL 1.1 laser with rotary: a separate process that listens on the loopback address only."""

from rigs.emulator.config import MachineConfig, config_for
from rigs.emulator.faults import Fault, read_faults
from rigs.emulator.launch import Emulator, start_emulator

__all__ = ["Emulator", "Fault", "MachineConfig", "config_for", "read_faults", "start_emulator"]
