"""Files that turn drawings into surfaces: what is computed with a drawing depends on them."""

from pathlib import Path

_NAMES = (
    "drawing_file", "geometry", "mesh", "mesh_crossing", "mesh_cuts", "mesh_file", "mesh_search",
    "mesh_shells", "mesh_simplify", "mesh_union", "mesh_winding", "mesher", "mesher_job", "outline",
    "plane_triangulation", "revolved",
)  # fmt: skip


def source_files() -> list[Path]:
    """Files of geometry."""
    return [Path(__file__).with_name(f"{name}.py") for name in _NAMES]
