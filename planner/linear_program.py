"""Linear programmes that grow by rows and are solved again from where the last solution stood.

HiGHS is used as it comes with scipy, through the class that keeps a basis between solutions. Scipy does not
promise that class; where it is missing the same programmes are solved afresh by ``scipy.optimize.linprog``.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["LinearProgram", "OutOfTimeError"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Solution = tuple[float, Floats, Floats]


class OutOfTimeError(Exception):
    """The time ran out before a solution was found."""


class LinearProgram:
    """Minimise ``cost @ x`` for ``0 <= x <= high``; equal rows stand at the start, ``<=`` rows come later."""

    def __init__(self, cost: Floats, high: Floats, rows: Ints, columns: Ints, right: Floats) -> None:
        """Set it up.

        Args:
            cost: (C,) per column.
            high: (C,) upper bounds.
            rows: (E,) row of every entry of the equal rows, all entries are 1.
            columns: (E,) and its column.
            right: (R,) right sides of the equal rows.
        """
        self._cost, self._right = cost, right
        self._rows, self._columns = rows, columns
        self._added: list[tuple[list[int], list[float], float]] = []
        core = _highs_core()
        self._solver: Any = None if core is None else _warm_solver(core, cost, high, rows, columns, right)

    def add(self, rows: Sequence[tuple[list[int], list[float], float]]) -> None:
        """Add rows (columns, coefficients, upper bound)."""
        if not rows:
            return
        self._added.extend(rows)
        if self._solver is not None:
            starts = np.cumsum([0, *(len(columns) for columns, _, _ in rows[:-1])]).astype(np.int32)
            columns = np.concatenate([columns for columns, _, _ in rows]).astype(np.int32)
            values = np.concatenate([values for _, values, _ in rows]).astype(np.float64)
            high = np.array([bound for _, _, bound in rows], dtype=np.float64)
            low = np.full(len(rows), -math.inf)
            self._solver.addRows(len(rows), low, high, len(columns), starts, columns, values)

    def solve(self, high: Floats, seconds: float) -> Solution | None:
        """Value, columns and dual values of the added rows (<= 0); None if there is no solution.

        Args:
            high: (C,) upper bounds of the columns this time.
            seconds: time limit.

        Raises:
            OutOfTimeError: if the time limit was reached.
        """
        if seconds <= 0.0:
            raise OutOfTimeError
        return (
            self._solve_warm(high, seconds) if self._solver is not None else self._solve_cold(high, seconds)
        )

    def _solve_warm(self, high: Floats, seconds: float) -> Solution | None:
        solver = self._solver
        count = len(high)
        solver.changeColsBounds(count, np.arange(count, dtype=np.int32), np.zeros(count), high)
        solver.setOptionValue("time_limit", solver.getRunTime() + seconds)
        solver.run()
        status = solver.getModelStatus().name
        if status in ("kInfeasible", "kUnboundedOrInfeasible"):
            return None
        if status != "kOptimal":
            raise OutOfTimeError
        solution = solver.getSolution()
        duals = np.array(solution.row_dual, dtype=np.float64)[len(self._right) :]
        value = float(solver.getInfo().objective_function_value)
        return value, np.array(solution.col_value, dtype=np.float64), duals

    def _solve_cold(self, high: Floats, seconds: float) -> Solution | None:
        from scipy.optimize import linprog
        from scipy.sparse import csr_array

        columns = len(self._cost)
        equal = csr_array(
            (np.ones(len(self._rows)), (self._rows, self._columns)), (len(self._right), columns)
        )
        sizes = [len(index) for index, _, _ in self._added]
        entries = np.array([value for _, values, _ in self._added for value in values], dtype=np.float64)
        places = np.array([column for index, _, _ in self._added for column in index], dtype=np.int64)
        under = csr_array((entries, (np.repeat(np.arange(len(sizes)), sizes), places)), (len(sizes), columns))
        bounds = np.array([bound for _, _, bound in self._added], dtype=np.float64)
        problem: dict[str, Any] = {
            "c": self._cost, "A_eq": equal, "b_eq": self._right,
            "bounds": np.stack([np.zeros(columns), high], axis=1),
        }  # fmt: skip
        if sizes:
            problem |= {"A_ub": under, "b_ub": bounds}
        found = linprog(**problem, method="highs", options={"time_limit": seconds})
        if found.status == 2:
            return None
        if found.status != 0:
            raise OutOfTimeError
        duals = np.asarray(found.ineqlin.marginals, dtype=np.float64) if sizes else np.zeros(0)
        return float(found.fun or 0.0), np.asarray(found.x, dtype=np.float64), duals


def _highs_core() -> ModuleType | None:
    """The HiGHS classes inside scipy; None if they are not there."""
    try:
        core = importlib.import_module("scipy.optimize._highspy._core")
    except ImportError:
        return None
    return core if hasattr(core, "_Highs") and hasattr(core, "HighsLp") else None


def _warm_solver(
    core: ModuleType, cost: Floats, high: Floats, rows: Ints, columns: Ints, right: Floats
) -> Any:  # noqa: ANN401 - a class that scipy does not declare
    """A silent HiGHS with the equal rows in it; None if its classes are not as expected."""
    order = np.lexsort((columns, rows))
    try:
        problem = core.HighsLp()
        problem.num_col_, problem.num_row_ = len(cost), len(right)
        problem.col_cost_, problem.col_lower_, problem.col_upper_ = cost, np.zeros(len(cost)), high
        problem.row_lower_, problem.row_upper_ = right, right
        matrix = problem.a_matrix_
        matrix.format_ = core.MatrixFormat.kRowwise
        matrix.num_col_, matrix.num_row_ = len(cost), len(right)
        matrix.start_ = np.searchsorted(rows[order], np.arange(len(right) + 1)).astype(np.int32)
        matrix.index_ = columns[order].astype(np.int32)
        matrix.value_ = np.ones(len(columns))
        solver: Any = core._Highs()
        solver.setOptionValue("output_flag", False)
        solver.setOptionValue("threads", 1)
        solver.passModel(problem)
        solver.getRunTime()
    except (AttributeError, TypeError):
        return None
    return solver
