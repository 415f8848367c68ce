"""Watching the beam's view of the turning crease in the pose that is simulated, sag included."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import mujoco
import numpy as np

from planner.fold_plan import FoldPlan
from twin.events import Event
from twin.loaded_model import LoadedModel
from twin.sight_rays import BeamView
from twin.timeline import Turn

__all__ = ["SightWatch"]


class SightWatch:
    """Tells a crease that is hidden as planned from one that only sag hides.

    Args:
        loaded: the simulation.
        plan: the plan.
        played: its turns.

    Attributes:
        events: creases hidden as planned, one event a step.
        by_sag: step → a crease that is hidden only because the part sags.
    """

    def __init__(self, loaded: LoadedModel, plan: FoldPlan, played: Sequence[Turn]) -> None:
        self.loaded, self.plan, self.played = loaded, plan, played
        self.events: list[Event] = []
        self.by_sag: dict[int, Event] = {}
        self._hidden_steps: set[int] = set()
        self._view: BeamView | None = None

    def look(self, turn: Turn, *, stepped: bool = False) -> None:
        """Is the crease in the beam's view now?

        Right after a time step (``stepped``) the pose is that at its beginning, where MuJoCo left the bodies.
        """
        if turn.crease < 0 or turn.step in self._hidden_steps:
            return
        data, qpos = self.loaded.data, self.loaded.qpos_address(turn.joint)
        angle = float(data.qpos[qpos])
        if stepped:
            angle -= float(data.qvel[qpos]) * float(self.loaded.model.opt.timestep)
        else:
            mujoco.mj_kinematics(self.loaded.model, data)
        if self._view is None or self._view.turn is not turn:
            self._view = BeamView(self.loaded, turn, self.plan.limits)
        hidden = self._view.hidden()
        if hidden.share <= self.plan.hidden_max:
            return
        planned = self._hidden_as_planned(turn, angle)
        side = self.loaded.compiled.side
        triangles = tuple(side.pieces[k].triangles[0] for k in hidden.pieces)
        named = ", ".join(
            [f"face {f}" for f in hidden.faces] + [f"substrate triangle {t}" for t in triangles]
        )
        event = Event(
            "occluded", turn.step, turn.crease, hidden.faces, triangles, angle_rad=angle,
            time_s=float(data.time),
            detail=f"{100 * hidden.share:.0f} % of crease {turn.crease} is hidden from the beam by {named} "
            f"at {np.degrees(angle):.1f}° (at most {100 * self.plan.hidden_max:.0f} % allowed)"
            + ("" if planned else ", but only while the part sags"),
        )  # fmt: skip
        if planned:
            self._hidden_steps.add(turn.step)
            self.events.append(event)
        else:
            self.by_sag.setdefault(turn.step, event)

    @cached_property
    def ideal(self) -> LoadedModel:
        """The model in poses without sag."""
        return self.loaded.other_pose()

    def _hidden_as_planned(self, turn: Turn, angle_rad: float) -> bool:
        """Would the crease be hidden if nothing sagged?"""
        ideal = self.ideal
        for done in self.played:
            if done.step >= turn.step:
                break
            ideal.set_angle(done.joint, done.to_rad)
        ideal.set_angle(turn.joint, angle_rad)
        mujoco.mj_kinematics(ideal.model, ideal.data)
        return BeamView(ideal, turn, self.plan.limits).hidden().share > self.plan.hidden_max
