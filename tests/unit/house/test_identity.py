"""What results depend on is frozen: an edit that makes users compute again is seen before it lands.

Where this test fails, the digits are others, or they are the same.

- Others: say so in CHANGELOG.md and freeze the new identities with
  ``python -m benchmarks.house.same_digits identities > tests/unit/house/identity.json``.
- The same: ``python -m benchmarks.house.same_digits COMMIT`` shows it and keeps the identity.

A new key with a default and a moved function change nothing here.
"""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.house.same_digits.__main__ import identities, states
from sandmould.digest import equal_code

FROZEN = json.loads(Path(__file__).with_name("identity.json").read_text(encoding="utf-8"))


def test_results_keep_their_identity() -> None:
    now = identities()
    changed = {name for name in FROZEN.keys() | now.keys() if FROZEN.get(name) != now.get(name)}
    assert not changed, __doc__


def test_only_code_of_today_is_listed_as_equal() -> None:
    gone = equal_code().keys() - set(states().values())
    assert not gone, "code that is no more: take its lines out of sandmould/equal_code.toml"
