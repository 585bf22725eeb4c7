"""A session in front of another one hands on all that it does not change."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from sandmould.engines.session import Session
from sandmould.pattern_fe.coupling.delegating_session import DelegatingSession

MEMBERS = [name for name in vars(Session) if not name.startswith("_")]
GIVEN: dict[str, tuple[Any, ...]] = {
    "insert_layer": (1,),
    "set_state": (np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 3))),
    "start_stage": (Mock(),),
    "advance": (0.5,),
    "write_checkpoint": (Path("folder"),),
    "share": ("value",),
}


@pytest.mark.parametrize("member", MEMBERS)
def test_every_member_of_a_session_is_the_sands(member: str) -> None:
    sand = Mock(spec=MEMBERS)
    session: Session = DelegatingSession(sand)
    if isinstance(vars(Session)[member], property):
        assert getattr(session, member) is getattr(sand, member)
        return
    given = GIVEN.get(member, ())
    result = getattr(session, member)(*given)
    getattr(sand, member).assert_called_once_with(*given)
    assert result is None or result is getattr(sand, member).return_value
