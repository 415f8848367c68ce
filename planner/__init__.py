"""Net, contact, sight and fold plan: geometry and decisions, no physics and no machine.

The names below are the public API; their modules load when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.lazy_package import lazy_names

if TYPE_CHECKING:
    from planner.base_faces import BaseRank as BaseRank
    from planner.base_faces import rank_bases as rank_bases
    from planner.blooming_trees import blooming_tree as blooming_tree
    from planner.contact_certificate import certify_contact as certify_contact
    from planner.cured_net import make_net_with_cures as make_net_with_cures
    from planner.diagnose import diagnose as diagnose
    from planner.dual_graph import DualGraph as DualGraph
    from planner.errors import FormatError as FormatError
    from planner.errors import MeshError as MeshError
    from planner.errors import NetError as NetError
    from planner.errors import PlanError as PlanError
    from planner.errors import PlannerError as PlannerError
    from planner.fewest_edits import prove_net as prove_net
    from planner.flat_layout import FlatLayout as FlatLayout
    from planner.fold_file import read_fold as read_fold
    from planner.fold_file import write_fold as write_fold
    from planner.fold_plan import FoldPlan as FoldPlan
    from planner.fold_plan import MachineLimits as MachineLimits
    from planner.fold_plan import Sheet as Sheet
    from planner.goal_file import read_goal_ply as read_goal_ply
    from planner.goal_file import write_goal_ply as write_goal_ply
    from planner.goal_mesh import GoalMesh as GoalMesh
    from planner.kinematics import folded_triangles as folded_triangles
    from planner.make_net import make_net as make_net
    from planner.mesh_facts import describe_mesh as describe_mesh
    from planner.motion_baselines import FOLD_METHODS as FOLD_METHODS
    from planner.nearly_blooming import nearly_blooming as nearly_blooming
    from planner.net import Net as Net
    from planner.net import NetCertificate as NetCertificate
    from planner.net_methods import NET_METHODS as NET_METHODS
    from planner.net_proof import verify_fold as verify_fold
    from planner.overlap import overlapping_faces as overlapping_faces
    from planner.placement import place_net as place_net
    from planner.plan_file import read_plan as read_plan
    from planner.plan_file import write_plan as write_plan
    from planner.plan_folds import plan_folds as plan_folds
    from planner.read_goal import read_goal as read_goal
    from planner.sheet_dxf import write_sheet_dxf as write_sheet_dxf
    from planner.sheet_svg import write_sheet_svg as write_sheet_svg
    from planner.substrate import make_sheet as make_sheet

_MODULES = {
    "BaseRank": "planner.base_faces",
    "DualGraph": "planner.dual_graph",
    "FlatLayout": "planner.flat_layout",
    "FOLD_METHODS": "planner.motion_baselines",
    "FoldPlan": "planner.fold_plan",
    "FormatError": "planner.errors",
    "GoalMesh": "planner.goal_mesh",
    "MachineLimits": "planner.fold_plan",
    "MeshError": "planner.errors",
    "NET_METHODS": "planner.net_methods",
    "Net": "planner.net",
    "NetCertificate": "planner.net",
    "NetError": "planner.errors",
    "PlanError": "planner.errors",
    "PlannerError": "planner.errors",
    "Sheet": "planner.fold_plan",
    "blooming_tree": "planner.blooming_trees",
    "certify_contact": "planner.contact_certificate",
    "describe_mesh": "planner.mesh_facts",
    "diagnose": "planner.diagnose",
    "folded_triangles": "planner.kinematics",
    "make_net": "planner.make_net",
    "make_net_with_cures": "planner.cured_net",
    "make_sheet": "planner.substrate",
    "nearly_blooming": "planner.nearly_blooming",
    "overlapping_faces": "planner.overlap",
    "place_net": "planner.placement",
    "plan_folds": "planner.plan_folds",
    "prove_net": "planner.fewest_edits",
    "rank_bases": "planner.base_faces",
    "read_fold": "planner.fold_file",
    "read_goal": "planner.read_goal",
    "read_goal_ply": "planner.goal_file",
    "read_plan": "planner.plan_file",
    "verify_fold": "planner.net_proof",
    "write_fold": "planner.fold_file",
    "write_goal_ply": "planner.goal_file",
    "write_plan": "planner.plan_file",
    "write_sheet_dxf": "planner.sheet_dxf",
    "write_sheet_svg": "planner.sheet_svg",
}

__all__ = sorted(_MODULES)

__getattr__ = lazy_names(__name__, _MODULES)
