"""How far a crease can turn in sight of the beam, asked for many rotary angles at once."""

from __future__ import annotations

import numpy as np

from planner._kernels.beam_kernels import BEAM_SIZE, OVERHANG_RAD, aim, lean
from planner._kernels.compiled import entry
from planner._kernels.sight_kernels import FINE_SUBSTEPS, REFINED_RAD, hidden_share, sight_limit

NOBODY, OWN_FLAP = -1, -2


@entry
def seen_to(  # type: ignore[no-untyped-def]
    panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, present,
    ox, oy, ux, uy, length, sign, now, wanted, rotary, ex, ey, head, hidden_max, out,
):  # fmt: skip
    """How far a crease is seen, for each of several rotary angles.

    Args:
        panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii: as in ``hidden_share``.
        present: (N,) solids that exist.
        ox, oy, ux, uy, length, sign: the crease and the sense of its turn, as there.
        now: absolute angle at which it stands.
        wanted: angle by which it is to turn on, >= 0.
        rotary: (K,) rotary angles.
        ex, ey, head: rotary axis and light, as in ``aim``.
        hidden_max: largest share that may be hidden.
        out: (K, 4) rows: angle by which it may turn on, -1 if it is hidden already; share hidden just beyond;
            the solid that hides most there, OWN_FLAP if the face leans over its crease, NOBODY if it is seen
            all the way; absolute angle at which the face reaches the beam, overhang included.
    """
    suspects = np.flatnonzero(present)
    intervals, turned = np.empty((len(solids), 2)), np.empty((3, 3))
    beam = np.zeros(BEAM_SIZE)
    mx, my = ox + 0.5 * length * ux, oy + 0.5 * length * uy
    for b in range(len(rotary)):
        aim(rotary[b], ex, ey, head, beam)
        out[b, 3] = lean(beam, mx, my, ux, uy, sign) + OVERHANG_RAD
        own = out[b, 3] - now
        if own < 0.0:
            out[b, 0], out[b, 1], out[b, 2] = -1.0, 1.0, OWN_FLAP
            continue
        allowed = min(own, wanted)
        seen, by = sight_limit(
            panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
            ox, oy, ux, uy, length, sign, allowed, beam, hidden_max, intervals, turned, FINE_SUBSTEPS, True,
        )  # fmt: skip
        if by < 0:
            out[b, 0], out[b, 1], out[b, 2] = allowed, 0.0, NOBODY
            if own < wanted:
                out[b, 1], out[b, 2] = 1.0, OWN_FLAP
            continue
        share, _, _ = hidden_share(
            panel_a, panel_b, panel, moving_mask, flat, solids, centres, radii, suspects,
            ox, oy, ux, uy, length, sign, min(allowed, seen + REFINED_RAD) if seen >= 0.0 else 0.0, beam,
            intervals, turned,
        )  # fmt: skip
        out[b, 0], out[b, 1], out[b, 2] = seen, share, by
