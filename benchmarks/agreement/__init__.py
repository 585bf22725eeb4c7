"""Pages on studies whose settings should agree: docs/engine_twins.md, docs/repose_settings.md."""
