"""The dynamic run: heated hinges with inertia and gravity, slow enough for a verdict on sag and yield.

Contact forces between thin plates are not to be relied on, so contacts are only noticed, never pushed apart,
and the run never decides about contact: where the sweep saw a hit it stops. A touch that it did not see
comes from sag or inertia. How hard the hinges in between would press is estimated; where they could not make
way within half their yield the turn is run again at half the speed, and what then stays is sag. All other
touches are noted.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from planner.values import frozen_array
from twin.events import Event
from twin.heating_interface import EqualPasses, Heating
from twin.loaded_model import LoadedModel, quiet_mujoco
from twin.mjcf_model import CompiledModel
from twin.sight_rays import hidden_by
from twin.sweep import SweepResult
from twin.timeline import Turn, turns
from twin.touches import Touch, contact_event, touches
from twin.units import NEWTON_METRE

__all__ = ["DynamicResult", "RunSettings", "dynamic_run"]


@dataclass(frozen=True)
class RunSettings:
    """How slowly and with what the plan is run.

    Attributes:
        gravity: False for the fidelity test.
        least_turn_s: shortest time of a turn.
        fastest_rad_s: mean rate of a turn is at most this.
        settle_s: time of rest after the last turn and after a change of gravity.
        depth_tolerance_mm: a touch up to this depth is none.
        heavy_yield_share: a touch for which hinges must go further than this share of yield is sag.
        past_onset_rad: how far a turn that the sweep saw blocked is driven past the first touch.
        largest_lag_rad: the turning hinge may lag by this; more is a failed run.
        largest_rate_rad_s: no hinge may turn faster; more is a failed run.
        sight_every_rad: the beam's view is tested again each time the crease has turned by this.
    """

    gravity: bool = True
    least_turn_s: float = 0.2
    fastest_rad_s: float = 4.0
    settle_s: float = 0.25
    depth_tolerance_mm: float = 0.01
    heavy_yield_share: float = 0.5
    past_onset_rad: float = float(np.radians(2.0))
    largest_lag_rad: float = float(np.radians(15.0))
    largest_rate_rad_s: float = 200.0
    sight_every_rad: float = float(np.radians(10.0))


@dataclass(frozen=True, eq=False)
class DynamicResult:
    """What the dynamic run found.

    Attributes:
        angles_rad: (E,) angle of every net edge at the end, gravity as in the last step.
        permanent_rad: (E,) plastic angle of every net edge at the end.
        events: findings in the order of the plan.
        touches: touches that matter no further, the deepest of each pair.
        missed: events of the sweep that the run should have felt and did not.
        finished: False if it was stopped by a hit or a failure.
        steps: number of time steps.
        seconds: simulated time.
        largest_sag_rad: largest elastic angle of a hinge at rest at the end.
        yield_share: largest elastic angle of a hinge at any time, as a share of the yield angle.
        tab_moment_n_m: largest static moment of the part's weight on the base, N m.
        warnings: messages of MuJoCo.
        state_sha256: hash of the final state, for bit-identity on one machine and version.
    """

    angles_rad: NDArray[np.float64]
    permanent_rad: NDArray[np.float64]
    events: tuple[Event, ...]
    touches: tuple[Event, ...]
    missed: tuple[Event, ...]
    finished: bool
    steps: int
    seconds: float
    largest_sag_rad: float
    yield_share: float
    tab_moment_n_m: float
    warnings: tuple[str, ...]
    state_sha256: str


def dynamic_run(
    compiled: CompiledModel,
    plan: FoldPlan,
    sweep: SweepResult,
    heating: Heating | None = None,
    settings: RunSettings | None = None,
) -> DynamicResult:
    """Fold the plan with heated hinges under gravity.

    Args:
        compiled: model of the plan.
        plan: the plan.
        sweep: result of the kinematic sweep of the same plan.
        heating: how plastic angles grow; equal passes if None.
        settings: speeds and bounds.

    Raises:
        ModelError: if the model was compiled from another net.
    """
    loaded = LoadedModel(compiled, plan.net)
    loaded.notice_contacts_only()
    run = _Run(loaded, plan, sweep, heating or EqualPasses(), settings or RunSettings())
    with quiet_mujoco() as messages:
        finished = run.play(turns(plan, compiled.side), messages)
    state = _state(loaded)
    permanent = np.zeros(len(plan.net.edges))
    for crease in compiled.side.panel_crease.tolist():
        if crease >= 0:
            permanent[crease] = loaded.data.plastic[loaded.plastic_address(f"crease_{crease}")]
    return DynamicResult(
        angles_rad=frozen_array(loaded.crease_angles(), np.float64, (None,)),
        permanent_rad=frozen_array(permanent, np.float64, (None,)),
        events=tuple(run.events), touches=run.light_touches(), missed=tuple(run.missed),
        finished=finished, steps=run.steps,
        seconds=run.steps * float(loaded.model.opt.timestep),
        largest_sag_rad=float(np.abs(run.elastic()).max(initial=0.0)),
        yield_share=run.worst_elastic / compiled.side.hinge.yield_rad,
        tab_moment_n_m=run.tab_moment, warnings=tuple(messages),
        state_sha256=hashlib.sha256(state.tobytes()).hexdigest(),
    )  # fmt: skip


class _DivergedError(Exception):
    """The simulation has left the bounds within which it means anything."""


class _Run:
    def __init__(
        self, loaded: LoadedModel, plan: FoldPlan, sweep: SweepResult, heating: Heating, settings: RunSettings
    ) -> None:
        self.loaded, self.plan, self.heating, self.settings = loaded, plan, heating, settings
        self.hits: dict[int, list[Event]] = {}
        for event in sweep.events:
            self.hits.setdefault(event.step, []).append(event)
        self.events: list[Event] = []
        self.missed: list[Event] = []
        self.light: dict[tuple[tuple[int, ...], tuple[int, ...]], Event] = {}
        self.steps = 0
        self.worst_elastic = 0.0
        self.tab_moment = 0.0
        self.rotary = 0.0
        model = loaded.model
        hinged = np.flatnonzero(model.jnt_plasticadr >= 0)
        self.qpos, self.plastic = model.jnt_qposadr[hinged], model.jnt_plasticadr[hinged]

    def elastic(self) -> NDArray[np.float64]:
        """Elastic angle of every hinge."""
        lag: NDArray[np.float64] = self.loaded.data.qpos[self.qpos] - self.loaded.data.plastic[self.plastic]
        return lag

    def play(self, played: tuple[Turn, ...], messages: list[str]) -> bool:
        """Run all turns; False if it had to stop."""
        turn = None
        try:
            for turn in played:
                self._face_up(turn, first=turn is played[0])
                if not self._turn(turn):
                    return False
            self._rest(self.settings.settle_s)
            if messages:
                raise _DivergedError(f"MuJoCo warned: {messages[0]}")
        except _DivergedError as failure:
            step, crease = (turn.step, turn.crease) if turn is not None else (0, -1)
            time = self.steps * float(self.loaded.model.opt.timestep)
            self.events.append(Event("numerical", step, crease, time_s=time, detail=str(failure)))
            return False
        return True

    def _face_up(self, turn: Turn, *, first: bool) -> None:
        """Turn gravity gently to where it acts during ``turn``, from nothing before the first one."""
        if not first and turn.rotary_rad == self.rotary:
            return
        count = self._count(self.settings.settle_s)
        before = turn.rotary_rad if first else self.rotary
        for k in range(1, count + 1):
            share = k / count
            share *= share * (3.0 - 2.0 * share)
            self.loaded.set_rotary(before + share * (turn.rotary_rad - before), self.settings.gravity)
            if first:
                self.loaded.model.opt.gravity[:] *= share
            self._step()
        self.rotary = turn.rotary_rad
        self._rest(self.settings.settle_s / 2.0)
        self._weigh()

    def _turn(self, turn: Turn) -> bool:
        """One turn; False if the sweep says that it is blocked."""
        self._look(turn)
        hits = self.hits.get(turn.step, [])
        if hits:
            seen = self._drive(turn, 1.0, stop_at=hits[0].angle_rad)
            felt = {t.pair for t in seen}
            self.missed += [hits[0]] if hits[0].pair not in felt else []
            return False
        checkpoint = _state(self.loaded)
        seen = self._drive(turn, 1.0)
        if any(self._heavy(t) for t in seen):  # inertia, or sag? the slower run decides
            first_look, first_steps = _state(self.loaded), self.steps
            self._restore(checkpoint)
            seen = self._drive(turn, 0.5)
            self.events += [contact_event("sag", turn, t) for t in seen if self._heavy(t)]
            seen = [t for t in seen if not self._heavy(t)]
            self._restore(first_look)
            self.steps = first_steps
        for touch in seen:
            if touch.pair not in self.light or touch.depth_mm > self.light[touch.pair].depth_mm:
                self.light[touch.pair] = contact_event("sag", turn, touch)
        return True

    def _restore(self, state: NDArray[np.float64]) -> None:
        mujoco.mj_setState(self.loaded.model, self.loaded.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def _heavy(self, touch: Touch) -> bool:
        """Do the hinges have to give more than half their yield angle to make way?"""
        return touch.yield_share > self.settings.heavy_yield_share

    def light_touches(self) -> tuple[Event, ...]:
        """The light touches, in the order of the plan."""
        return tuple(sorted(self.light.values(), key=lambda e: (e.step, e.pair)))

    def _drive(self, turn: Turn, speed: float, stop_at: float | None = None) -> list[Touch]:
        """Add the plastic increments of a turn over its time; touches seen, the deepest of each pair."""
        loaded, settings = self.loaded, self.settings
        data, plastic, qpos = loaded.data, loaded.plastic_address(turn.joint), loaded.qpos_address(turn.joint)
        heights = np.concatenate([[0.0], np.cumsum(self.heating.plastic_increments(turn))])
        angle = abs(float(heights[-1]))
        count = self._count(max(settings.least_turn_s, angle / settings.fastest_rad_s) / speed)
        loaded.moving_contacts_on(turn)
        seen: dict[tuple[tuple[int, ...], tuple[int, ...]], Touch] = {}
        given, looked = 0.0, 0.0
        base = float(data.plastic[plastic])
        for k in range(1, count + 1):
            share = k / count
            share *= share * (3.0 - 2.0 * share)
            wanted = float(np.interp(share * (len(heights) - 1), np.arange(len(heights)), heights))
            if stop_at is not None and abs(wanted) > abs(stop_at - turn.from_rad) + settings.past_onset_rad:
                break
            data.plastic[plastic] += wanted - given
            given = wanted
            self._step()
            self._collect(turn, seen)
            if abs(data.qpos[qpos] - (base + given)) > settings.largest_lag_rad:
                lag = np.degrees(data.qpos[qpos] - base - given)
                raise _DivergedError(f"{turn.joint} is {lag:.1f}° away from where it was driven")
            if abs(given) - looked >= settings.sight_every_rad and stop_at is None:
                looked = abs(given)
                self._look(turn)
        for _ in range(5):
            self._step()
            self._collect(turn, seen)
        if stop_at is None:
            loaded.all_contacts_on(turn.gone)
            mujoco.mj_kinematics(loaded.model, data)
            mujoco.mj_collision(loaded.model, data)
            self._collect(turn, seen)
        return [seen[key] for key in sorted(seen)]

    def _collect(self, turn: Turn, seen: dict[tuple[tuple[int, ...], tuple[int, ...]], Touch]) -> None:
        if self.loaded.data.ncon == 0:
            return
        for touch in touches(self.plan, self.loaded, turn, self.settings.depth_tolerance_mm):
            known = seen.get(touch.pair)
            if known is None or touch.depth_mm > known.depth_mm:
                seen[touch.pair] = touch

    def _look(self, turn: Turn) -> None:
        """Is the crease in the beam's view?"""
        if turn.crease < 0:
            return
        mujoco.mj_kinematics(self.loaded.model, self.loaded.data)
        hidden = hidden_by(self.loaded, turn)
        if hidden.share <= self.plan.hidden_max or any(
            e.kind == "occluded" and e.step == turn.step for e in self.events
        ):
            return
        side = self.loaded.compiled.side
        triangles = tuple(side.pieces[k].triangles[0] for k in hidden.pieces)
        named = ", ".join(
            [f"face {f}" for f in hidden.faces] + [f"substrate triangle {t}" for t in triangles]
        )
        angle = float(self.loaded.data.qpos[self.loaded.qpos_address(turn.joint)])
        self.events.append(
            Event(
                "occluded", turn.step, turn.crease, hidden.faces, triangles, angle_rad=angle,
                time_s=float(self.loaded.data.time),
                detail=f"{100 * hidden.share:.0f} % of crease {turn.crease} is hidden from the beam by "
                f"{named} at {np.degrees(angle):.1f}° (at most {100 * self.plan.hidden_max:.0f} % allowed)",
            )
        )  # fmt: skip

    def _count(self, seconds: float) -> int:
        return max(1, int(np.ceil(seconds / float(self.loaded.model.opt.timestep) - 1e-9)))

    def _rest(self, seconds: float) -> None:
        for _ in range(self._count(seconds)):
            self._step()

    def _weigh(self) -> None:
        """Moment of the weight of all that hangs on the base panel, about the centre of that panel."""
        model, data = self.loaded.model, self.loaded.data
        base = model.body(f"panel_{self.loaded.compiled.side.panel_root[0]}").id
        children = np.flatnonzero(model.body_parentid == base)
        mujoco.mj_comPos(model, data)
        moment = np.zeros(3)
        for body in children.tolist():
            arm = data.subtree_com[body] - data.xipos[base]
            moment += np.cross(arm, model.body_subtreemass[body] * model.opt.gravity)
        self.tab_moment = max(self.tab_moment, float(np.linalg.norm(moment)) / NEWTON_METRE)

    def _step(self) -> None:
        data = self.loaded.data
        mujoco.mj_step(self.loaded.model, data)
        self.steps += 1
        rate = float(np.abs(data.qvel).max(initial=0.0))
        if not rate <= self.settings.largest_rate_rad_s:
            raise _DivergedError(f"a hinge turns at {rate:.3g} rad/s")
        self.worst_elastic = max(self.worst_elastic, float(np.abs(self.elastic()).max(initial=0.0)))


def _state(loaded: LoadedModel) -> NDArray[np.float64]:
    """Everything that the next step depends on."""
    signature = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(loaded.model, signature))
    mujoco.mj_getState(loaded.model, loaded.data, state, signature)
    return state
