"""What operations are called in the OpenAPI document: names that a generated client can be read with."""

from __future__ import annotations

from fastapi.routing import APIRoute

NAMES: dict[tuple[str, str], str] = {
    ("POST", "/v1/jobs"): "submit_job",
    ("GET", "/v1/jobs"): "list_jobs",
    ("POST", "/v1/jobs/check"): "check_job",
    ("GET", "/v1/jobs/{job}"): "get_job",
    ("PATCH", "/v1/jobs/{job}"): "mark_job",
    ("DELETE", "/v1/jobs/{job}"): "cancel_job",
    ("POST", "/v1/jobs/{job}/rerun"): "rerun_job",
    ("POST", "/v1/jobs/{job}/extend"): "extend_job",
    ("GET", "/v1/jobs/{job}/request"): "get_job_request",
    ("GET", "/v1/jobs/{job}/attempts"): "list_job_attempts",
    ("GET", "/v1/jobs/{job}/events"): "follow_job",
    ("GET", "/v1/jobs/{job}/results"): "get_job_results",
    ("GET", "/v1/jobs/{job}/trajectories"): "get_job_trajectories",
    ("GET", "/v1/jobs/{job}/indices"): "get_job_indices",
    ("GET", "/v1/jobs/{job}/spreads"): "get_job_spreads",
    ("GET", "/v1/jobs/{job}/answer"): "get_job_answer",
    ("GET", "/v1/jobs/{job}/cases/{case}/trajectory"): "get_case_trajectory",
    ("GET", "/v1/jobs/{job}/cases/{case}/animation"): "get_case_animation",
    ("GET", "/v1/jobs/{job}/cases/{case}/events"): "get_case_events",
    ("GET", "/v1/jobs/{job}/bins"): "get_job_bins",
    ("GET", "/v1/jobs/{job}/scene"): "get_job_scene",
    ("GET", "/v1/models"): "list_models",
    ("GET", "/v1/models/{name}"): "get_model",
    ("GET", "/v1/schema"): "get_scene_schema",
    ("POST", "/v1/scenes/check"): "check_scene",
    ("POST", "/v1/scenes/view"): "view_scene",
    ("POST", "/v1/fmus"): "export_fmu",
    ("POST", "/v1/sensitivities"): "compute_sensitivities",
    ("GET", "/v1/usage"): "get_usage",
    ("GET", "/v1/audit"): "list_audit",
    ("POST", "/v1/keys"): "make_key",
    ("GET", "/v1/keys"): "list_keys",
    ("DELETE", "/v1/keys/{key}"): "revoke_key",
    ("GET", "/healthz"): "get_health",
    ("GET", "/readyz"): "get_readiness",
    ("GET", "/metrics"): "get_metrics",
}


def named(route: APIRoute) -> str:
    """The name of an operation."""
    (method,) = route.methods or {"GET"}
    return NAMES.get((method, route.path_format), route.name)
