"""What a calibration is worth: residuals, coverage, predicted energy; as data and as text."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from autd_trials.calibration.cloud import coverage, lacking_parts
from autd_trials.calibration.solve import Solution

WORKSPACE_HALF_MM = 300.0
"""The workspace is a cube of this half edge around the target."""

UNSEEN = (
    "small residuals do not prove a good focus: a sensor that sits elsewhere on its unit than assumed leaves "
    "every residual unchanged, and only sound can show it (--acoustic)"
)

_PARTS_OF_TIME = 6


def report(solution: Solution) -> dict[str, Any]:
    """Return the report as JSON-able data."""
    calibration = solution.calibration
    energy = calibration.predicted_energy
    centre_mm = np.array(energy.target_mm) if energy else solution.cloud.centre_mm
    cells = coverage(_middles_mm(solution), centre_mm, WORKSPACE_HALF_MM)
    return {
        "method": calibration.method,
        "points": solution.cloud.points,
        "cloud": {
            "centre_mm": solution.cloud.centre_mm.round(1).tolist(),
            "half_extents_mm": solution.cloud.half_extents_mm.round(1).tolist(),
            "angle_between_units_deg": _rounded(solution.cloud.angle_deg, 1),
        },
        "coverage": {
            "workspace_half_mm": WORKSPACE_HALF_MM,
            "points_in_cells": cells.tolist(),
            "cells_without_points": int((cells == 0).sum()),
            "lacking": lacking_parts(cells),
        },
        "units": [_unit_report(solution, unit) for unit in range(1, len(calibration.units))],
        "predicted_energy": None if energy is None else energy.model_dump(),
        "unseen": UNSEEN,
        "warnings": list(solution.warnings),
    }


def report_text(facts: dict[str, Any]) -> str:
    """Return the report for people."""
    lines = [f"{facts['points']} right points; {facts['method']}"]
    for unit in facts["units"]:
        gaps, sd, clock_s = unit["rms_per_axis_mm"], unit["sd_at_target"], unit["clock_offset_s"]
        lines.append(
            f"{unit['name']}: residuals {unit['rms_mm']:.2f} mm rms (x {gaps[0]:.2f}, y {gaps[1]:.2f}, "
            f"z {gaps[2]:.2f}), {unit['outliers']} of {unit['points']} points left out"
            + ("" if clock_s is None else f", clock {1000 * clock_s:+.1f} ms")
        )
        lines.append(f"  over time: {', '.join(_number(value) for value in unit['rms_over_time_mm'])} mm rms")
        if sd is not None:
            lines.append(
                f"  known to {sd['position_mm']:.2f} mm and {sd['angle_deg']:.3f} deg (standard deviations)"
            )
        if unit["range_error"] is not None:
            wrong = unit["range_error"]
            bias = f"{wrong['bias_mm']:+.1f} +- {wrong['bias_sd_mm']:.1f} mm"
            scale = f", scale {wrong['scale']:+.4f} +- {wrong['scale_sd']:.4f}" if wrong["scale_sd"] else ""
            lines.append(f"  range wrong by {bias}{scale}")
    energy = facts["predicted_energy"]
    if energy is not None:
        x, y, z = energy["target_mm"]
        lines.append(
            f"energy left at ({x:g}, {y:g}, {z:g}) mm: {energy['mean']:.3f}, 90 % within {energy['low']:.3f} "
            f"to {energy['high']:.3f} (from the points alone)"
        )
    if facts["coverage"]["lacking"]:
        lines.append(f"few points in the workspace's parts: {', '.join(facts['coverage']['lacking'])}")
    lines.append(UNSEEN)
    return "\n".join(lines)


def _unit_report(solution: Solution, unit: int) -> dict[str, Any]:
    calibrated = solution.calibration.units[unit]
    assert calibrated.residuals is not None
    assert calibrated.counts is not None
    gaps_mm, clocks_s = solution.gaps_mm(unit), solution.clock_offsets_s
    parts = np.array_split(np.linalg.norm(gaps_mm, axis=1), _PARTS_OF_TIME)
    return {
        "name": calibrated.name,
        **calibrated.counts.model_dump(),
        **calibrated.residuals.model_dump(),
        "rms_per_axis_mm": np.sqrt(np.nanmean(gaps_mm**2, axis=0)).round(4).tolist(),
        "rms_over_time_mm": [_rms(part) for part in parts],
        "clock_offset_s": None if clocks_s is None else round(float(clocks_s[unit]), 6),
        "sd_at_target": _sd_at_target(solution, unit),
        "range_error": None if calibrated.range_error is None else calibrated.range_error.model_dump(),
    }


def _sd_at_target(solution: Solution, unit: int) -> dict[str, float] | None:
    """Return how well the pose is known at the target: roots of the variances summed over the axes."""
    calibrated, energy = solution.calibration.units[unit], solution.calibration.predicted_energy
    if calibrated.covariance is None or energy is None:
        return None
    x, y, z = np.array(energy.target_mm) - np.array(calibrated.translation_mm)
    covariance = np.array(calibrated.covariance)
    lever = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
    return {
        "position_mm": round(float(np.sqrt(np.trace(lever @ covariance @ lever.T))), 4),
        "angle_deg": round(float(np.degrees(np.sqrt(np.trace(covariance[3:, 3:])))), 5),
    }


def _middles_mm(solution: Solution) -> NDArray[np.float64]:
    right = ~np.isnan(solution.places_mm[:, :, 0])
    middles: NDArray[np.float64] = np.nanmean(solution.places_mm[:, right.sum(axis=0) > 1], axis=0)
    return middles


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)


def _rms(lengths_mm: NDArray[np.float64]) -> float | None:
    right = lengths_mm[~np.isnan(lengths_mm)]
    return round(float(np.sqrt((right**2).mean())), 4) if len(right) else None


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f}"
