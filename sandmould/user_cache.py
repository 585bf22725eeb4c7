"""Where the house keeps what every folder of the user's can use again."""

import os
from pathlib import Path


def user_cache() -> Path:
    """Folder of the house in the user's cache; it may not be there yet."""
    # A relative one would lie in the folder that happens to be worked in; so it counts as none.
    stated = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (stated if stated.is_absolute() else Path.home() / ".cache") / "sandmould"
