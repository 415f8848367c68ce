"""A bundle while stages work on it: typed values read from its files, each once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.manifest import MANIFEST_NAME, Manifest
from studio.options import MachineOptions
from studio.progress import Progress

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan, MachineLimits
    from planner.goal_mesh import GoalMesh
    from planner.net import Net
    from rigs.job import Job
    from rigs.material import Material
    from rigs.process import Process
    from rigs.rig import Rig

__all__ = ["MATERIAL_FILE", "RIG_FILE", "Workspace"]

RIG_FILE = "rig.toml"
MATERIAL_FILE = "material.toml"

_FROM_PLAN = ("plan", "process", "job", "gcode")
_READ_FROM = {
    "goal.ply": ("goal", "net", *_FROM_PLAN),
    "net.fold": ("net", *_FROM_PLAN),
    "plan.json": _FROM_PLAN,
    RIG_FILE: ("rig", "limits", *_FROM_PLAN),
    MATERIAL_FILE: ("material", "limits", *_FROM_PLAN),
}
"""File → the values that follow from it."""


@dataclass
class Workspace:
    """Folder and manifest of a bundle in the making.

    Values are read back from the files even within one run, so that ``make`` and the stages run one by one
    cannot differ.

    Attributes:
        folder: where the files are.
        manifest: what they hash to.
        progress: where to tell how far it is.
    """

    folder: Path
    manifest: Manifest
    progress: Progress = field(default_factory=lambda: Progress(quiet=True))

    def path(self, name: str) -> Path:
        """Path of a file of the bundle."""
        return self.folder / name

    def record(self, stage: str, *names: str) -> None:
        """Note files that a stage wrote, and forget what was read from them before."""
        self.manifest.record(self.folder, stage, list(names))
        for name in names:
            entry = self.manifest.files[name]
            self.progress.detail(f"         {name}: {entry['bytes']} bytes, sha256 {entry['sha256'][:16]}")
        for name in names:
            for value in _READ_FROM.get(name, ()):
                self.__dict__.pop(value, None)

    def finish(self) -> None:
        """Write the manifest."""
        self.path(MANIFEST_NAME).write_bytes(self.manifest.to_bytes())

    def choose_machine(self, options: MachineOptions, stage: str) -> None:
        """Copy the profiles of rig and material into the bundle.

        Raises:
            ProfileError: if a profile is wrong.
            UnknownNameError: if no profile has that name.
        """
        from rigs.limits import machine_limits
        from rigs.material import load_material, material_names
        from rigs.profile_writer import profile_toml
        from rigs.rig import load_rig, rig_names

        rig, material = load_rig(options.rig), load_material(options.material)
        limits = machine_limits(rig, material, options.thickness_mm)
        for name, choice, names, folder in (
            (RIG_FILE, options.rig, rig_names(), "profiles"),
            (MATERIAL_FILE, options.material, material_names(), "materials"),
        ):
            if choice in names:
                data = (resources.files("rigs") / folder / f"{choice}.toml").read_bytes()
            elif choice.partition("/")[0] in names and not choice.endswith(".toml"):
                data = profile_toml(material, f"{choice}, written out for this temper").encode()
            else:
                data = Path(choice).read_bytes()
            self.path(name).write_bytes(data)
        self.manifest.rig = {"name": rig.name, "sha256": rig.sha256}
        self.manifest.material = {
            "name": material.name,
            "sha256": material.sha256,
            "thickness_mm": limits.thickness,
        }
        self.record(stage, RIG_FILE, MATERIAL_FILE)

    @cached_property
    def rig(self) -> Rig:
        """The machine."""
        from rigs.rig import load_rig

        self.manifest.sha256_of(RIG_FILE)
        return load_rig(self.path(RIG_FILE))

    @cached_property
    def material(self) -> Material:
        """The sheet metal."""
        from rigs.material import load_material

        self.manifest.sha256_of(MATERIAL_FILE)
        return load_material(self.path(MATERIAL_FILE))

    @cached_property
    def limits(self) -> MachineLimits:
        """What rig and material allow."""
        from rigs.limits import machine_limits

        return machine_limits(self.rig, self.material, float(self.manifest.material["thickness_mm"]))

    @cached_property
    def goal(self) -> GoalMesh:
        """The goal mesh."""
        from planner.goal_file import read_goal_ply

        self.manifest.sha256_of("goal.ply")
        known = self.manifest.goal
        return replace(
            read_goal_ply(self.path("goal.ply")),
            name=str(known.get("name", "goal")),
            notices=tuple(map(str, known.get("notices", ()))),
            source_sha256=str(self.manifest.input.get("sha256", "")),
        )

    @cached_property
    def net(self) -> Net:
        """The flat net."""
        from planner.fold_file import read_fold

        self.manifest.sha256_of("net.fold")
        return read_fold(self.path("net.fold"), self.goal)

    @cached_property
    def plan(self) -> FoldPlan:
        """The fold plan."""
        from planner.plan_file import read_plan

        self.manifest.sha256_of("plan.json")
        return read_plan(self.path("plan.json"), self.net)

    @cached_property
    def process(self) -> Process:
        """Passes, power, speed and waits of every step; follows from plan, rig and material."""
        from studio.heat_stage import made_process

        return made_process(self, self.plan)

    @cached_property
    def job(self) -> Job:
        """Blocks for the machine; follow from plan, process, rig and material."""
        from rigs.job_build import make_job

        return make_job(self.plan, self.process, self.rig, self.material, self.hashes("goal", "net", "plan"))

    @cached_property
    def gcode(self) -> bytes:
        """The job as G-code."""
        from rigs.gcode import write_gcode

        written: Any = write_gcode(self.job)
        return written if isinstance(written, bytes) else str(written).encode("ascii")

    def hashes(self, *names: str) -> dict[str, str]:
        """Hashes of ``names`` (of goal, net, plan, model) and of rig and material, to bind files together."""
        manifest = self.manifest
        known = {
            "goal": lambda: manifest.sha256_of("goal.ply"),
            "net": lambda: manifest.sha256_of("net.fold"),
            "plan": lambda: manifest.sha256_of("plan.json"),
            "model": lambda: manifest.sha256_of("model.xml"),
            "rig": lambda: str(manifest.rig["sha256"]),
            "material": lambda: str(manifest.material["sha256"]),
        }
        chosen = dict.fromkeys((*names, "rig", "material"))
        return {name: known[name]() for name in chosen}
