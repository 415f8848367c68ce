"""One simulation of a plan: hinges driven turn by turn, with what is seen on the way.

Contact forces between thin plates are not to be relied on, so contacts are only noticed, never pushed apart,
and the run never decides about contact: where the sweep saw a hit it stops. A touch that it did not see
comes from sag or inertia. How hard the hinges in between would press is estimated; where they could not make
way within half their yield, or where a hinge at rest bends for good, the turn is run again more slowly, and
what then stays is sag or yield. All other touches are noted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from twin.events import Event
from twin.heating_interface import Heating
from twin.loaded_model import LoadedModel
from twin.sight_rays import hidden_by
from twin.sweep import SweepResult
from twin.timeline import Turn, turns
from twin.touches import Touch, contact_event, touches
from twin.units import NEWTON_METRE

__all__ = ["DrivenRun", "RunSettings", "integration_state"]


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
        bent_rad: a hinge at rest that bends by more than this for good asks for a slower run.
        speeds: the turn's speed, and the slower ones that are tried when a touch or a bent hinge asks for it.
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
    bent_rad: float = float(np.radians(0.02))
    speeds: tuple[float, ...] = (1.0, 0.5, 0.25)
    past_onset_rad: float = float(np.radians(2.0))
    largest_lag_rad: float = float(np.radians(15.0))
    largest_rate_rad_s: float = 200.0
    sight_every_rad: float = float(np.radians(10.0))


class _DivergedError(Exception):
    """The simulation has left the bounds within which it means anything."""


class DrivenRun:
    """State of one run: the model, what was seen so far, and how to go on."""

    def __init__(
        self, loaded: LoadedModel, plan: FoldPlan, sweep: SweepResult, heating: Heating, settings: RunSettings
    ) -> None:
        self.loaded, self.plan, self.heating, self.settings = loaded, plan, heating, settings
        self.hits: dict[int, list[Event]] = {}
        for event in sweep.events:
            self.hits.setdefault(event.step, []).append(event)
        self.events: list[Event] = []
        self.missed: list[Event] = []
        self.hidden_steps: set[int] = set()
        self.sag_hides: dict[int, Event] = {}
        self.yields: dict[int, Event] = {}
        self.played = turns(plan, loaded.compiled.side)
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

    def play(self, messages: list[str]) -> bool:
        """Run all turns; False if it had to stop."""
        turn = None
        try:
            for turn in self.played:
                self._face_up(turn, first=turn is self.played[0])
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
        checkpoint, steps = integration_state(self.loaded), self.steps
        before = self._plastic_of_others(turn)
        for speed in self.settings.speeds:  # inertia, or weight? a slower run decides
            self._restore(checkpoint)
            self.steps = steps
            seen = self._drive(turn, speed)
            bent = np.abs(self._plastic_of_others(turn) - before).max(initial=0.0)
            if bent <= self.settings.bent_rad and not any(self._heavy(t) for t in seen):
                break
        if bent > self.settings.bent_rad:
            self._note_yield(turn, before)
        self.events += [contact_event("sag", turn, t) for t in seen if self._heavy(t)]
        seen = [t for t in seen if not self._heavy(t)]
        for touch in seen:
            if touch.pair not in self.light or touch.depth_mm > self.light[touch.pair].depth_mm:
                self.light[touch.pair] = contact_event("sag", turn, touch)
        return True

    def _restore(self, state: NDArray[np.float64]) -> None:
        mujoco.mj_setState(self.loaded.model, self.loaded.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)

    def _plastic_of_others(self, turn: Turn) -> NDArray[np.float64]:
        """Plastic angles of the hinges that are at rest."""
        own = self.loaded.plastic_address(turn.joint)
        angles: NDArray[np.float64] = np.delete(self.loaded.data.plastic, own)
        return angles

    def _note_yield(self, turn: Turn, before: NDArray[np.float64]) -> None:
        """Remember which hinge at rest bent for good; its end angle decides whether that matters."""
        names = [name for name in self.loaded.joint if name != turn.joint]
        change = self._plastic_of_others(turn) - before
        worst = int(np.argmax(np.abs(change)))
        self.yields[turn.step] = Event(
            "sag", turn.step, turn.crease, time_s=float(self.loaded.data.time),
            angle_rad=float(self.loaded.data.qpos[self.loaded.qpos_address(turn.joint)]),
            detail=f"{names[worst]} yields under the load by {np.degrees(change[worst]):.2f}° "
            f"as {turn.joint} turns",
        )  # fmt: skip

    def _heavy(self, touch: Touch) -> bool:
        """Do the hinges have to give more than half their yield angle to make way?"""
        return touch.yield_share > self.settings.heavy_yield_share

    @cached_property
    def ideal(self) -> LoadedModel:
        """A second model, for poses without sag."""
        return LoadedModel(self.loaded.compiled, self.plan.net)

    def noted(self) -> tuple[Event, ...]:
        """Light touches, creases that only sag hides, hinges that yield, in the order of the plan."""
        found = (*self.light.values(), *self.sag_hides.values(), *self.yields.values())
        return tuple(sorted(found, key=lambda e: (e.step, e.pair)))

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
        """Is the crease in the beam's view? Hidden by sag alone is noted, hidden as planned is an event."""
        if turn.crease < 0 or turn.step in self.hidden_steps:
            return
        mujoco.mj_kinematics(self.loaded.model, self.loaded.data)
        hidden = hidden_by(self.loaded, turn, self.plan.limits)
        if hidden.share <= self.plan.hidden_max:
            return
        angle = float(self.loaded.data.qpos[self.loaded.qpos_address(turn.joint)])
        planned = self._hidden_as_planned(turn, angle)
        side = self.loaded.compiled.side
        triangles = tuple(side.pieces[k].triangles[0] for k in hidden.pieces)
        named = ", ".join(
            [f"face {f}" for f in hidden.faces] + [f"substrate triangle {t}" for t in triangles]
        )
        event = Event(
            "occluded", turn.step, turn.crease, hidden.faces, triangles, angle_rad=angle,
            time_s=float(self.loaded.data.time),
            detail=f"{100 * hidden.share:.0f} % of crease {turn.crease} is hidden from the beam by {named} "
            f"at {np.degrees(angle):.1f}° (at most {100 * self.plan.hidden_max:.0f} % allowed)"
            + ("" if planned else ", but only while the part sags"),
        )  # fmt: skip
        if planned:
            self.hidden_steps.add(turn.step)
            self.events.append(event)
        else:
            self.sag_hides.setdefault(turn.step, event)

    def _hidden_as_planned(self, turn: Turn, angle_rad: float) -> bool:
        """Would the crease be hidden if nothing sagged?"""
        ideal = self.ideal
        for done in self.played:
            if done.step >= turn.step:
                break
            ideal.set_angle(done.joint, done.to_rad)
        ideal.set_angle(turn.joint, angle_rad)
        ideal.all_contacts_on(turn.gone)
        mujoco.mj_kinematics(ideal.model, ideal.data)
        return hidden_by(ideal, turn, self.plan.limits).share > self.plan.hidden_max

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


def integration_state(loaded: LoadedModel) -> NDArray[np.float64]:
    """Everything that the next step depends on."""
    signature = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(loaded.model, signature))
    mujoco.mj_getState(loaded.model, loaded.data, state, signature)
    return state
