"""Machines: profiles, jobs, G-code, the driver, replay, journal and the emulator."""
