"""The emulator's process: one client on a loopback socket, and the clock of the simulated machine."""

from __future__ import annotations

import contextlib
import select
import socket
import time

from rigs.emulator.machine import GrblMachine
from rigs.emulator.wires import Wires

__all__ = ["serve"]

_IDLE_S = 0.2
_JUMPS = 4


def serve(
    machine: GrblMachine,
    listener: socket.socket,
    time_scale: float,
    parent_fd: int | None = None,
    baud: int = 0,
) -> None:
    """Serve clients one after another until ``parent_fd`` closes.

    Args:
        machine: the emulated machine; it goes on running while nobody is connected.
        listener: a bound, listening loopback socket.
        time_scale: simulated seconds in a second of the wall clock; 0 jumps from event to event as
            soon as the received bytes are dealt with, so that a job takes as long as its bytes take.
        parent_fd: a descriptor that becomes readable at end of file when the starting process ends.
        baud: pace of the link in simulated time, bits a second; 0 passes bytes at once.
    """
    wires = Wires(machine, baud)
    client: socket.socket | None = None
    last = time.monotonic()
    while True:
        event = wires.next_event()
        if event is None:
            patience = _IDLE_S
        elif time_scale > 0.0:
            patience = min(max((event - machine.now) / time_scale, 0.0), _IDLE_S)
        else:
            patience = 0.0
        watched: list[socket.socket | int] = [listener]
        watched += [client] if client is not None and wires.room else []
        watched += [parent_fd] if parent_fd is not None else []
        ready = select.select(watched, [], [], patience)[0]
        now = time.monotonic()
        if time_scale > 0.0:
            wires.advance(machine.now + (now - last) * time_scale)
        elif not ready:
            _jump(wires)
        last = now
        if parent_fd is not None and parent_fd in ready:
            break
        if client is not None and client in ready:
            client = _read(wires, client)  # before accepting: it may have hung up
            if time_scale == 0.0:
                _jump(wires)
        elif listener in ready:
            client = _accept(machine, listener, client)
        if client is None:
            wires.hang_up()
        elif data := wires.arrived():
            client = _write(data, client)
        if machine.dropped and client is not None:
            client.close()
            client = None
            machine.dropped = False
    if client is not None:
        client.close()


def _jump(wires: Wires) -> None:
    """A few events at once: a block's moves and its sync then cost one answer on the wire, not three."""
    for _ in range(_JUMPS):
        if (event := wires.next_event()) is None:
            return
        wires.advance(event)


def _accept(machine: GrblMachine, listener: socket.socket, client: socket.socket | None) -> socket.socket:
    fresh, _ = listener.accept()
    if client is not None:
        fresh.close()  # one process per port
        return client
    fresh.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    machine.out.clear()
    if machine.config.resets_on_open:
        machine.power_cycle()
    return fresh


def _read(wires: Wires, client: socket.socket) -> socket.socket | None:
    try:
        data = client.recv(wires.room)
    except OSError:
        data = b""
    if not data:
        with contextlib.suppress(OSError):
            client.close()
        return None
    wires.take(data)
    return client


def _write(data: bytes, client: socket.socket) -> socket.socket | None:
    try:
        client.sendall(data)
    except OSError:
        with contextlib.suppress(OSError):
            client.close()
        return None
    return client
