"""One simulation of a plan: hinges driven turn by turn, with what is seen on the way.

Contact forces between thin plates are not to be relied on, so contacts are only noticed, never pushed apart,
and the run never decides about contact: where the sweep saw a hit it stops. A touch that it did not see
comes from sag or inertia. How hard the hinges in between would press is estimated; where they could not make
way within half their yield, or where a hinge at rest bends for good, the turn is run again more slowly, and
what then stays is sag or yield. All other touches are noted.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from twin.black_box import BlackBox, black_box_of
from twin.events import Event
from twin.heating_interface import Heating
from twin.loaded_model import LoadedModel
from twin.run_settings import RunSettings
from twin.sight_watch import SightWatch
from twin.stepper import Checkpoint, DivergedError, Stepper, integration_state, restore_state
from twin.sweep import SweepResult
from twin.timeline import Turn, turns
from twin.touches import Touch, TouchLog, contact_event
from twin.units import NEWTON_METRE

__all__ = ["DrivenRun"]

_Pair = tuple[tuple[int, ...], tuple[int, ...]]
_SETTLING_STEPS = 4


class DrivenRun:
    """State of one run: the model, what was seen so far, and how to go on.

    Args:
        loaded: a fresh simulation.
        plan: the plan.
        sweep: result of its kinematic sweep.
        heating: how plastic angles grow.
        settings: speeds and bounds.
        messages: where MuJoCo's warnings appear.
        start: a checkpoint of a run of the same model to go on from; the beginning if None.

    Attributes:
        events: findings, in the order of the plan.
        missed: events of the sweep that the run did not feel.
        felt: what the run felt of the hit that stopped it.
        checkpoints: one before the first turn and one after each.
        black_box: the last states before a failure, None if there was none.
    """

    def __init__(
        self, loaded: LoadedModel, plan: FoldPlan, sweep: SweepResult, heating: Heating,
        settings: RunSettings, messages: list[str], start: Checkpoint | None = None,
    ) -> None:  # fmt: skip
        self.loaded, self.plan, self.heating, self.settings = loaded, plan, heating, settings
        self.stepper = Stepper(loaded, settings, messages)
        self.hits: dict[int, list[Event]] = {}
        for event in sweep.events:
            self.hits.setdefault(event.step, []).append(event)
        self.played = turns(plan, loaded.compiled.side)
        self.sight = SightWatch(loaded, plan, self.played)
        self.events: list[Event] = []
        self.missed: list[Event] = []
        self.felt: tuple[Touch, ...] = ()
        self.yields: dict[int, Event] = {}
        self.light: dict[_Pair, Event] = {}
        self.checkpoints: list[Checkpoint] = []
        self.black_box: BlackBox | None = None
        self.tab_moment = 0.0
        self.rotary: float | None = None
        self.done = -1
        if start is not None:
            self._start_from(start)

    def play(self) -> bool:
        """Run all turns that are left; False if it had to stop."""
        turn = None
        try:
            for turn in self.played:
                if turn.step <= self.done:
                    continue
                self._face_up(turn)
                if not self.checkpoints:
                    self._checkpoint(self.done)
                if not self._turn(turn):
                    return False
                self._checkpoint(turn.step)
            self.stepper.rest(self.settings.settle_s)
        except DivergedError as failure:
            self._fail(turn, str(failure))
            return False
        return True

    def noted(self) -> tuple[Event, ...]:
        """Light touches, creases that only sag hides, hinges that yield, in the order of the plan."""
        found = (*self.light.values(), *self.sight.by_sag.values(), *self.yields.values())
        return tuple(sorted(found, key=lambda e: (e.step, e.pair)))

    def _checkpoint(self, step: int) -> None:
        self.checkpoints.append(
            Checkpoint(
                step, integration_state(self.loaded), self.loaded.model.opt.gravity,
                self.rotary if self.rotary is not None else 0.0, self.stepper.steps,
                self.stepper.worst_elastic_rad, self.tab_moment,
            )
        )  # fmt: skip

    def _start_from(self, start: Checkpoint) -> None:
        restore_state(self.loaded, start.state)
        self.loaded.model.opt.gravity[:] = start.gravity
        self.rotary, self.done = start.rotary_rad, start.step
        self.stepper.steps, self.stepper.worst_elastic_rad = start.steps, start.worst_elastic_rad
        self.tab_moment = start.tab_moment_n_m
        self.checkpoints.append(start)

    def _fail(self, turn: Turn | None, why: str) -> None:
        """The run is worth nothing from here on: say so, and keep what led to it."""
        step, crease = (turn.step, turn.crease) if turn is not None else (0, -1)
        angle = (
            float(self.loaded.data.qpos[self.loaded.qpos_address(turn.joint)]) if turn is not None else 0.0
        )
        event = Event(
            "numerical", step, crease, self._joined_by(crease), time_s=self.stepper.time_s, detail=why,
            angle_rad=angle if np.isfinite(angle) else 0.0,
        )  # fmt: skip
        self.events.append(event)
        states, gravity = self.stepper.last_states()
        self.black_box = black_box_of(
            self.loaded.compiled, event, states, gravity, self.stepper.present_state()
        )

    def _joined_by(self, crease: int) -> tuple[int, ...]:
        """The two faces of a crease, the turning one first."""
        child = self.plan.net.child_of.get(crease)
        return () if child is None else (int(child), int(self.plan.net.parent[child]))

    def _face_up(self, turn: Turn) -> None:
        """Turn gravity gently to where it acts during ``turn``, from nothing before the first one."""
        first = self.rotary is None
        if turn.rotary_rad == self.rotary:
            return
        before = turn.rotary_rad if self.rotary is None else self.rotary
        flags = self.stepper.contacts(on=False)
        count = self.stepper.count(self.settings.settle_s)
        for k in range(1, count + 1):
            share = k / count
            share *= share * (3.0 - 2.0 * share)
            self.loaded.set_rotary(before + share * (turn.rotary_rad - before), self.settings.gravity)
            if first:
                self.loaded.model.opt.gravity[:] *= share
            self.stepper.step()
        self.loaded.model.opt.disableflags = flags
        self.rotary = turn.rotary_rad
        self.stepper.rest(self.settings.settle_s / 2.0)
        self._weigh()

    def _turn(self, turn: Turn) -> bool:
        """One turn; False if the sweep says that it is blocked."""
        self.sight.look(turn)
        hits = self.hits.get(turn.step, [])
        if hits:
            self.felt = tuple(self._drive(turn, 1.0, stop_at=hits[0].angle_rad))
            self.missed += [hits[0]] if hits[0].pair not in {t.pair for t in self.felt} else []
            return False
        last, steps = self.checkpoints[-1], self.stepper.steps
        state = last.state if last.steps == steps else integration_state(self.loaded)
        before = self._rest_of_others(turn)
        for attempt, speed in enumerate(self.settings.speeds):  # inertia, or weight? a slower run decides
            if attempt:
                self.stepper.go_back(state, steps)
            seen = self._drive(turn, speed)
            bent = float(np.abs(self._rest_of_others(turn) - before).max())
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

    def _rest_of_others(self, turn: Turn) -> NDArray[np.float64]:
        """Rest angles of the hinges, 0 for the one that turns."""
        rest = self.loaded.rest
        angles = rest.all()
        angles[rest.at[turn.joint]] = 0.0
        return angles

    def _note_yield(self, turn: Turn, before: NDArray[np.float64]) -> None:
        """Remember which hinge at rest bent for good; its end angle decides whether that matters."""
        names = self.loaded.rest.names
        change = self._rest_of_others(turn) - before
        worst = int(np.argmax(np.abs(change)))
        crease = int(names[worst].rpartition("_")[2]) if names[worst].startswith("crease_") else -1
        self.yields[turn.step] = Event(
            "sag", turn.step, turn.crease, self._joined_by(crease), time_s=float(self.loaded.data.time),
            angle_rad=float(self.loaded.data.qpos[self.loaded.qpos_address(turn.joint)]),
            detail=f"{names[worst]} yields under the load by {np.degrees(change[worst]):.2f}° "
            f"as {turn.joint} turns",
        )  # fmt: skip

    def _heavy(self, touch: Touch) -> bool:
        """Do the hinges have to give more than half their yield angle to make way?"""
        return touch.yield_share > self.settings.heavy_yield_share

    def _drive(self, turn: Turn, speed: float, stop_at: float | None = None) -> list[Touch]:
        """Add the plastic increments of a turn over its time; touches seen, the deepest of each pair."""
        loaded, settings, step = self.loaded, self.settings, self.stepper.step
        data, qpos = loaded.data, loaded.qpos_address(turn.joint)
        given, looked, base = 0.0, 0.0, loaded.rest.of(turn.joint)
        loaded.moving_contacts_on(turn)
        log = TouchLog(self.plan, loaded, turn, settings.depth_tolerance_mm)
        for wanted in self._angles_given(turn, speed):
            if stop_at is not None and abs(wanted) > abs(stop_at - turn.from_rad) + settings.past_onset_rad:
                break
            loaded.rest.add(turn.joint, wanted - given)
            given = wanted
            step()
            if data.ncon:
                log.note()
            if not abs(data.qpos[qpos] - (base + given)) <= settings.largest_lag_rad:
                lag = np.degrees(data.qpos[qpos] - base - given)
                raise DivergedError(f"{turn.joint} is {lag:.1f}° away from where it was driven")
            if abs(given) - looked >= settings.sight_every_rad and stop_at is None:
                looked = abs(given)
                self.sight.look(turn, stepped=True)
        for _ in range(_SETTLING_STEPS):
            step()
            log.note()
        if stop_at is None:
            loaded.all_contacts_on(turn.gone)
            step()  # its search for contacts is the full check of everything with everything
            log.note()
        return log.touches()

    def _angles_given(self, turn: Turn, speed: float) -> list[float]:
        """Plastic angle that the turn has been given by each of its steps, smoothly from 0 on."""
        heights = np.concatenate([[0.0], np.cumsum(self.heating.plastic_increments(turn))])
        least = abs(float(heights[-1])) / self.settings.fastest_rad_s
        # A heating model that gives no figure shows as a failed run, not as an error here.
        seconds = max(self.settings.least_turn_s, least if np.isfinite(least) else 0.0) / speed
        count = self.stepper.count(seconds)
        share = np.arange(1, count + 1) / count
        share *= share * (3.0 - 2.0 * share)
        angles: list[float] = np.interp(share * (len(heights) - 1), np.arange(len(heights)), heights).tolist()
        return angles

    def _weigh(self) -> None:
        """Moment of the weight of all that hangs on the base panel, about the centre of that panel."""
        model, data = self.loaded.model, self.loaded.data
        base = model.body(f"panel_{self.loaded.compiled.side.panel_root[0]}").id
        children = np.flatnonzero(model.body_parentid == base)
        mujoco.mj_comPos(model, data)
        arms = data.subtree_com[children] - data.xipos[base]
        weights = model.body_subtreemass[children, None] * model.opt.gravity
        moment = np.cross(arms, weights).sum(axis=0)
        self.tab_moment = max(self.tab_moment, float(np.linalg.norm(moment)) / NEWTON_METRE)
