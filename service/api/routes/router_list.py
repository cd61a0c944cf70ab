"""The list of all endpoint files of the API. A new endpoint needs a file in this folder and a line here."""

from __future__ import annotations

from importlib import import_module

from fastapi import APIRouter

FILES = (
    "jobs",
    "results_and_trajectories",
    "bins_and_case_events",
    "indices_spreads_answer",
    "models_scenes_fmus",
    "sensitivities",
    "tags_usage_audit",
    "keys_health_metrics",
)
ROUTERS: tuple[APIRouter, ...] = tuple(import_module(f"trunnion.service.api.routes.{file}").router for file in FILES)
