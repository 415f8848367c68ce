"""Physics: heating, MuJoCo model, validation and process table.

The names below are the public API; their modules load when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.lazy_package import lazy_names

if TYPE_CHECKING:
    from twin.dynamics import dynamic_run as dynamic_run
    from twin.errors import HeatingError as HeatingError
    from twin.errors import TwinError as TwinError
    from twin.heating import bend as bend
    from twin.heating import fold_passes as fold_passes
    from twin.mjcf_model import CompiledModel as CompiledModel
    from twin.mjcf_model import compile_model as compile_model
    from twin.plan_process import plan_process as plan_process
    from twin.section_model import SectionCase as SectionCase
    from twin.section_model import SectionResult as SectionResult
    from twin.section_model import section_bend as section_bend
    from twin.section_model import section_passes as section_passes
    from twin.sweep import kinematic_sweep as kinematic_sweep
    from twin.validation import Validation as Validation
    from twin.validation import validate as validate
    from twin.validation_file import read_validation as read_validation
    from twin.validation_file import write_validation as write_validation

_MODULES = {
    "CompiledModel": "twin.mjcf_model",
    "HeatingError": "twin.errors",
    "SectionCase": "twin.section_model",
    "SectionResult": "twin.section_model",
    "TwinError": "twin.errors",
    "Validation": "twin.validation",
    "bend": "twin.heating",
    "compile_model": "twin.mjcf_model",
    "dynamic_run": "twin.dynamics",
    "fold_passes": "twin.heating",
    "kinematic_sweep": "twin.sweep",
    "plan_process": "twin.plan_process",
    "read_validation": "twin.validation_file",
    "section_bend": "twin.section_model",
    "section_passes": "twin.section_model",
    "validate": "twin.validation",
    "write_validation": "twin.validation_file",
}

__all__ = sorted(_MODULES)

__getattr__ = lazy_names(__name__, _MODULES)
