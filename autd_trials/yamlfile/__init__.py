"""Reads a YAML file into a pydantic model; tells all that is wrong at once, with line, column and key."""

from autd_trials.yamlfile.load import load_model, load_with_sha256
from autd_trials.yamlfile.suggest import did_you_mean

__all__ = ["did_you_mean", "load_model", "load_with_sha256"]
